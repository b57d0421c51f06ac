"""Effects behind a drift: those that the diagnoses of the runs name, and the trend of the specimen."""

from collections.abc import Mapping, Sequence
from typing import Literal

from pydantic import AliasChoices, Field

from bench.campaigns import RunResult
from bench.catalogue import Catalogue
from bench.errors import ReportError
from bench.jobs import TREND_FILE
from bench.report import DocumentPart, format_name, read_document


class TrendChange(DocumentPart):
    """Course of one quantity over the runs of a trend."""

    quantity: str
    unit: str
    direction: str = Field(validation_alias=AliasChoices("direction", "way"))
    since: str | None = None
    change_per_run: float = Field(validation_alias=AliasChoices("change_per_run", "per_run"))

    @property
    def is_steady(self) -> bool:
        """True if the quantity does not change significantly."""
        return self.direction == "steady"


class TrendDocument(DocumentPart):
    """Part of the trend of a specimen that a report shows."""

    schema_: Literal["mrbench.trend/1"] = Field(alias="schema")
    changes: list[TrendChange]
    explanation: str


def find_trend(catalogue: Catalogue, runs: Sequence[str]) -> TrendDocument | None:
    """Return the newest trend that ends with one of some runs of a specimen, oldest first; None without one.

    A trend belongs to its newest run. A file that was removed or cannot be read counts as no trend.
    """
    for run in reversed(runs):
        job = catalogue.job_queue.find_newest_done(run, "trend")
        if job is None or not job.result:
            continue
        try:
            return read_document(catalogue.resolve_path(job.result) / TREND_FILE, TrendDocument, "a trend")
        except ReportError:
            continue
    return None


def describe_effects(runs: Sequence[int], results: Sequence[RunResult]) -> str:
    """Describe the effects that the diagnoses of runs name, and in which runs.

    Args:
        runs: number of each run in the report.
        results: result of each run.
    """
    diagnosed = [(run, result) for run, result in zip(runs, results, strict=True) if result.is_diagnosed]
    if not diagnosed:
        return "no run was diagnosed, so that no effect is named"
    found: dict[str, list[int]] = {}
    for run, result in diagnosed:
        for effect in result.effects:
            found.setdefault(effect, []).append(run)
    if not found:
        return f"the diagnoses of {len(diagnosed)} runs name no effect"
    return "; ".join(_describe_effect(name, found[name], len(diagnosed)) for name in sorted(found))


def _describe_effect(name: str, runs: Sequence[int], diagnosed: int) -> str:
    shown = ", ".join(map(str, runs))
    return f"{format_name(name)}, named by {len(runs)} of {diagnosed} diagnoses (run {shown})"


def describe_trend(specimen: str, trend: TrendDocument | None) -> str:
    """Describe the trend of a specimen with the effect behind it, or how to compute one."""
    if trend is not None:
        return f"Trend of {specimen}, all runs fitted with the same effects: {trend.explanation}"
    return (
        f"The trend of {specimen} was not computed. It fits the same effects to all runs and states which one"
        " changes: Compute the trend in the view of the specimen, or mrbench trend with its logs."
    )


def list_trends(catalogue: Catalogue, runs: Mapping[str, Sequence[str]]) -> dict[str, TrendDocument | None]:
    """Return the trend of each specimen; ``runs`` are the ids of its runs, oldest first."""
    return {specimen: find_trend(catalogue, ids) for specimen, ids in runs.items()}
