"""Content of a campaign report: the campaign with its newest results, numbered runs, mountings and series."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property

from bench.campaign_report.calibration import RunCalibration, read_calibrations
from bench.campaign_report.causes import TrendDocument, list_trends
from bench.campaign_report.drift import DriftLine, find_outliers, fit_drift
from bench.campaign_report.mountings import number_mountings
from bench.campaign_report.photos import make_photos
from bench.campaign_report.scatter import Scatter, analyse_scatter
from bench.campaigns import (
    CampaignState,
    CampaignStore,
    CampaignView,
    RunFact,
    RunResult,
    StoredCampaign,
    TrendView,
    get_step_kind,
    group_runs,
    make_trends,
    make_view,
    read_result,
)
from bench.report.layout import Picture

MAX_EVENTS = 20_000
"""Largest number of events that a report reads, the newest ones."""
_HOUR = 3600.0


@dataclass(frozen=True)
class Series:
    """One parameter over the runs of one specimen with one method and drive, oldest first."""

    trend: TrendView
    runs: tuple[int, ...]
    """Number of each run in the report."""
    mountings: tuple[int, ...]
    hours: tuple[float, ...]
    """Time from the start of the campaign to the end of each run [h]."""
    is_repetition: tuple[bool, ...]
    """False for a run with proposed strokes, whose method differs from that of the others."""

    @property
    def values(self) -> tuple[float, ...]:
        """Value in each run, in the unit of the parameter."""
        return tuple(point.value for point in self.trend.points)

    @property
    def half_widths(self) -> tuple[float | None, ...]:
        """Half of the 95 % interval of each value; None without one."""
        return tuple(point.half_width for point in self.trend.points)

    @cached_property
    def drift_per_run(self) -> DriftLine | None:
        """Line over the count of the runs of this series."""
        return fit_drift(list(range(len(self.runs))), self.values, self.half_widths)

    @cached_property
    def drift_per_hour(self) -> DriftLine | None:
        """Line over the time [h]."""
        return fit_drift(self.hours, self.values, self.half_widths)

    @cached_property
    def outliers(self) -> tuple[int, ...]:
        """Numbers of the runs that lie far from the line through all others."""
        return tuple(
            self.runs[k] for k in find_outliers(list(range(len(self.runs))), self.values, self.half_widths)
        )

    @cached_property
    def scatter(self) -> Scatter | None:
        """Repeatability and reproducibility; None without a run of the method as it is."""
        groups: dict[int, list[float]] = {}
        for value, mounting, is_repetition in zip(self.values, self.mountings, self.is_repetition, strict=True):
            if is_repetition:
                groups.setdefault(mounting, []).append(value)
        return analyse_scatter(list(groups.values())) if groups else None


@dataclass(frozen=True)
class Cell:
    """Runs of one specimen with one method and drive."""

    title: str
    specimen: str
    facts: tuple[RunFact, ...]
    results: tuple[RunResult, ...]
    """Result of each run; an empty one without a fit."""
    series: tuple[Series, ...]
    drive_unit: str


@dataclass(frozen=True)
class CampaignReport:
    """Everything that a campaign report states."""

    view: CampaignView
    """Campaign with all its events."""
    state: CampaignState
    key: str
    """SHA-256 of the document and its methods."""
    numbers: Mapping[str, int]
    """Number of each complete run by its id, in the order of time."""
    mountings: Mapping[str, int]
    starts: Mapping[str, datetime]
    """UTC at which each run began."""
    cells: Sequence[Cell]
    trends: Mapping[str, TrendDocument | None] = field(default_factory=dict)
    """Trend by specimen."""
    calibrations: Mapping[str, RunCalibration] = field(default_factory=dict)
    """Calibration by the id of each complete run."""
    photos: Mapping[str, Picture] = field(default_factory=dict)
    """Photos of the answers that can be shown, by the id of their step."""

    @property
    def series(self) -> list[Series]:
        """Series of all cells."""
        return [one for cell in self.cells for one in cell.series]

    def get_result(self, fact: RunFact) -> RunResult:
        """Return the result of a run; an empty one without a fit."""
        return self.state.results.get(fact.run, RunResult())


def gather_campaign(store: CampaignStore, campaign: StoredCampaign) -> CampaignReport:
    """Read everything that the report on a campaign states; the campaign need not have ended.

    Args:
        store: campaigns of a catalogue.
        campaign: campaign of this store.
    """
    catalogue, facts = store.catalogue, campaign.state.facts
    # Runs may have been identified after the end of the campaign, by hand or as a batch.
    found = {fact.run: read_result(catalogue, fact.run) for fact in facts}
    results = dict(campaign.state.results) | {run: result for run, result in found.items() if result is not None}
    state = campaign.state.model_copy(update={"results": results})
    events = store.table.list_newest_events(campaign.id, MAX_EVENTS)
    row = store.table.get(campaign.id)
    rows = {fact.run: catalogue.get_run(fact.run) for fact in facts}
    numbers = {fact.run: number for number, fact in enumerate(facts, 1)}
    mountings = number_mountings(state)
    units = {name: method.drive_unit for name, method in campaign.methods.items()}
    return CampaignReport(
        view=make_view(campaign._replace(state=state), events),
        state=state,
        key=row.key if row is not None else "",
        numbers=numbers,
        mountings=mountings,
        starts={run: row.started for run, row in rows.items() if row is not None} | _estimate_starts(state, rows),
        cells=_make_cells(state, units, numbers, mountings),
        trends=list_trends(catalogue, _group_by_specimen(facts)),
        calibrations=read_calibrations(catalogue, numbers),
        photos=make_photos(state, catalogue.folder),
    )


def _estimate_starts(state: CampaignState, rows: Mapping[str, object]) -> dict[str, datetime]:
    """Return the starts of the runs that are no longer in the catalogue, from their ends and durations."""
    lost = (fact for fact in state.facts if rows[fact.run] is None)
    return {fact.run: datetime.fromtimestamp(fact.ended - fact.duration_s, UTC) for fact in lost}


def _group_by_specimen(facts: Sequence[RunFact]) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for fact in facts:
        groups.setdefault(fact.specimen, []).append(fact.run)
    return groups


def _make_cells(
    state: CampaignState, units: Mapping[str, str], numbers: Mapping[str, int], mountings: Mapping[str, int]
) -> list[Cell]:
    trends: dict[tuple[str, str, float | None], list[TrendView]] = {}
    for trend in make_trends(state, units):
        trends.setdefault((trend.specimen, trend.method, trend.drive), []).append(trend)
    return [
        Cell(
            title=_describe_cell(specimen, method, drive, units[method]),
            specimen=specimen,
            facts=tuple(facts),
            results=tuple(state.results.get(fact.run, RunResult()) for fact in facts),
            series=tuple(
                _make_series(one, state, numbers, mountings) for one in trends.get((specimen, method, drive), ())
            ),
            drive_unit=units[method],
        )
        for (specimen, method, drive), facts in group_runs(state).items()
    ]


def _describe_cell(specimen: str, method: str, drive: float | None, unit: str) -> str:
    return f"{specimen}, {method}, {'drive of the method' if drive is None else f'{drive:g} {unit}'}"


def _make_series(
    trend: TrendView, state: CampaignState, numbers: Mapping[str, int], mountings: Mapping[str, int]
) -> Series:
    facts = {fact.run: fact for fact in state.facts}
    items = [state.get_item(facts[point.run].item) for point in trend.points]
    return Series(
        trend=trend,
        runs=tuple(numbers[point.run] for point in trend.points),
        mountings=tuple(mountings[point.run] for point in trend.points),
        hours=tuple((facts[point.run].ended - state.started) / _HOUR for point in trend.points),
        is_repetition=tuple(get_step_kind(item.step) != "next_stroke" for item in items),
    )
