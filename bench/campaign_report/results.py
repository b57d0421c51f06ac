"""Sections on the results: parameters by run, drift and outliers, repeatability and reproducibility."""

from collections.abc import Iterator, Sequence
from math import sqrt

from bench.campaign_report.causes import describe_effects, describe_trend
from bench.campaign_report.content import CampaignReport, Cell, Series
from bench.campaign_report.drift import MIN_OUTLIER_RUNS, MIN_RUNS, Z95, DriftLine
from bench.campaign_report.scatter import Scatter
from bench.campaigns import ParameterResult, RunFact, RunResult
from bench.report import format_force, format_name, format_quantity, format_ratio, format_significant, format_unit
from bench.report.layout import Section, Table

Row = tuple[str, ...]
_RUNS_PER_TABLE = 4
"""Largest number of runs in one table, so that it fits on a page of paper."""
_PLAIN_RANGE = (1e-2, 1e5)
"""Range of the numbers that are written without a power of ten."""
MAX_PICTURES = 24
"""Largest number of plots in one report."""
NO_FIT = "No run of this campaign has been identified, so that there are no parameters."


def format_number(value: float | None, digits: int = 3) -> str:
    """Format a number without its unit, with significant digits and a power of ten where it is needed."""
    if value is None:
        return "–"
    if value == 0 or _PLAIN_RANGE[0] <= abs(value) < _PLAIN_RANGE[1]:
        return format_significant(value, digits)
    return format_quantity(float(f"{value:.{digits - 1}e}"), None, "").value


def make_errors(report: CampaignReport) -> Section:
    """Make the section on fit and diagnosis of each run."""
    rows = [_make_error_row(report, fact) for fact in report.state.facts]
    header = (
        "Run",
        "Force error",
        "Noise floor",
        "Error over floor",
        "Verdict",
        "Named effects",
        "Remark",
    )
    table = Table(rows, header, (1, 2, 2, 2, 3, 4, 4), "Fit and diagnosis of each run")
    is_known = any(report.get_result(fact).parameters for fact in report.state.facts)
    return Section("Fits and diagnoses", [] if is_known else [NO_FIT], [table] if rows else [])


def _make_error_row(report: CampaignReport, fact: RunFact) -> Row:
    result = report.get_result(fact)
    error, floor = result.rmse_n, result.noise_floor_n
    return (
        str(report.numbers[fact.run]),
        "–" if error is None else format_force(error),
        "–" if floor is None else format_force(floor),
        format_ratio(error / floor) if error is not None and floor else "–",
        format_name(result.verdict) or "not diagnosed",
        ", ".join(map(format_name, result.effects)) or "none",
        result.failure or ("" if result.parameters else "not identified"),
    )


def make_results(report: CampaignReport) -> Section:
    """Make the section on the parameters of each run, with 95 % intervals."""
    tables = [table for cell in report.cells if cell.series for table in _make_result_tables(report, cell)]
    note = "Value with its 95 % interval, identified from each run by itself. A dash: not determined by the run."
    return Section("Parameters", [note if tables else NO_FIT], tables)


def _make_result_tables(report: CampaignReport, cell: Cell) -> Iterator[Table]:
    runs = list(zip(cell.facts, cell.results, strict=True))
    for start in range(0, len(runs), _RUNS_PER_TABLE):
        part = runs[start : start + _RUNS_PER_TABLE]
        header = ("Parameter", "Unit", *(f"Run {report.numbers[fact.run]}" for fact, _ in part))
        rows = [
            (
                one.trend.parameter,
                format_unit(one.trend.unit),
                *(_format_parameter(result, one.trend.parameter) for _, result in part),
            )
            for one in cell.series
        ]
        shown = ", ".join(str(report.numbers[fact.run]) for fact, _ in part)
        yield Table(rows, header, (2, 2, *(4 for _ in part)), f"Parameters, {cell.title}: run {shown}")


def _format_parameter(result: RunResult, name: str) -> str:
    found: ParameterResult | None = result.parameters.get(name)
    if found is None:
        return "–"
    interval = None if found.low is None or found.high is None else (found.low, found.high)
    return format_quantity(found.value, interval, "").value


def make_trends(report: CampaignReport) -> Section:
    """Make the section on drift and outliers of each parameter, with the effects behind them."""
    cells = [cell for cell in report.cells if cell.series]
    specimens = dict.fromkeys(cell.specimen for cell in cells)
    texts = [
        "The drift is the slope of a straight line through the values, weighted by their intervals, with its 95 %"
        " interval. The interval is wider where the values scatter more than their own intervals say. By chance it"
        " excludes zero for 1 parameter in 20. A remount between the runs can look like a drift.",
        f"A drift needs {MIN_RUNS} runs with an interval, an outlier {MIN_OUTLIER_RUNS}. An outlier is farther"
        " from the line through the other runs than chance allows, at 5 % for the whole series.",
        *(f"{cell.title}: {_describe_causes(report, cell)}." for cell in cells),
        *(describe_trend(specimen, report.trends.get(specimen)) for specimen in specimens),
    ]
    tables = [Table(*_make_drift_rows(cell), f"Drift, {cell.title}") for cell in cells]
    if len(cells) > MAX_PICTURES:
        texts.append(f"Plots are shown for the first {MAX_PICTURES} of {len(cells)} groups of runs.")
    pictures = [name_picture(number) for number, _ in enumerate(report.cells)]
    return Section("Trends, drift and outliers", texts if cells else [NO_FIT], tables, pictures)


def name_picture(number: int) -> str:
    """Return the name of the plot of a cell."""
    return f"trend-{number + 1}"


def _describe_causes(report: CampaignReport, cell: Cell) -> str:
    drifting = [
        one.trend.parameter for one in cell.series if one.drift_per_run and one.drift_per_run.is_significant
    ]
    runs = [report.numbers[fact.run] for fact in cell.facts]
    effects = describe_effects(runs, cell.results)
    if drifting:
        return f"drift of {', '.join(drifting)}; effect behind it: {effects}"
    if all(one.drift_per_run is None for one in cell.series):
        return f"too few runs for a drift, {MIN_RUNS} are needed and there are {len(runs)}; {effects}"
    return f"no parameter drifts significantly; {effects}"


def _make_drift_rows(cell: Cell) -> tuple[list[Row], Row, Sequence[float]]:
    header = ("Parameter", "Unit", "Drift per run", "Drift per hour", "Judgement", "Outliers")
    rows: list[Row] = [
        (
            one.trend.parameter,
            format_unit(one.trend.unit),
            _format_drift(one.drift_per_run),
            _format_drift(one.drift_per_hour),
            _judge_drift(one.drift_per_run),
            ", ".join(f"run {run}" for run in one.outliers) or "none",
        )
        for one in cell.series
    ]
    return rows, header, (2, 2, 4, 4, 3, 2)


def _format_drift(line: DriftLine | None) -> str:
    return "–" if line is None else format_quantity(line.slope, line.interval, "").value


def _judge_drift(line: DriftLine | None) -> str:
    if line is None:
        return "too few runs"
    if not line.is_significant:
        return "no significant drift"
    return "rises" if line.slope > 0 else "falls"


def make_scatter(report: CampaignReport) -> Section:
    """Make the section on repeatability and reproducibility of each parameter."""
    cells = [cell for cell in report.cells if any(one.scatter for one in cell.series)]
    texts = [
        "One-way analysis of variance with random effects as in ISO 5725-2; each mounting of a specimen is a"
        " group. s_r: standard deviation of runs in one mounting, with its 95 % interval; s_L: between mountings;"
        " s_R: of runs in different mountings, s_R² = s_r² + s_L². 95 % limits of the difference of two runs:"
        " r = 2.8 s_r in one mounting, R = 2.8 s_R in different ones.",
        "Runs with proposed strokes are left out, because their method differs. Few runs give wide intervals.",
        "Over the fit: s_r over the standard deviation that the fits themselves state. Above 1, runs scatter more"
        " than their intervals say.",
        *filter(None, (_describe_missing(cell) for cell in cells)),
    ]
    tables = [Table(*_make_scatter_rows(cell), f"Scatter, {cell.title}") for cell in cells]
    return Section("Repeatability and reproducibility", texts if cells else [NO_FIT], tables)


def _describe_missing(cell: Cell) -> str:
    """Describe the runs that are missing; the parameters of a cell mostly need the same."""
    needs: dict[str, list[str]] = {}
    for one in cell.series:
        if one.scatter is not None and one.scatter.missing:
            needs.setdefault(one.scatter.missing, []).append(one.trend.parameter)
    parts = [f"{'all parameters' if len(names) == len(cell.series) else ', '.join(names)}: {missing}"
             for missing, names in needs.items()]  # fmt: skip
    return f"{cell.title}, {'; '.join(parts)}." if parts else ""


def _make_scatter_rows(cell: Cell) -> tuple[list[Row], Row, Sequence[float]]:
    header = ("Parameter", "Unit", "Mountings, runs", "Mean", "s_r", "s_L", "s_R", "r", "R", "Over the fit")
    rows = [_make_scatter_row(one, one.scatter) for one in cell.series if one.scatter is not None]
    return rows, header, (3, 3, 3, 3, 5, 4, 3, 3, 3, 3)


def _make_scatter_row(one: Series, scatter: Scatter) -> Row:
    between = format_number(scatter.between)
    ratio = compute_fit_ratio(one)
    return (
        one.trend.parameter,
        format_unit(one.trend.unit),
        f"{scatter.mountings}, {scatter.runs}",
        format_number(scatter.mean, 4),
        _format_repeatability(scatter),
        f"{between} (estimate negative)" if scatter.is_clipped else between,
        format_number(scatter.reproducibility),
        format_number(scatter.repeatability_limit),
        format_number(scatter.reproducibility_limit),
        "–" if ratio is None else format_significant(ratio, 2),
    )


def _format_repeatability(scatter: Scatter) -> str:
    if scatter.repeatability is None or scatter.repeatability_ci95 is None:
        return "–"
    return format_quantity(scatter.repeatability, scatter.repeatability_ci95, "").value


def compute_fit_ratio(one: Series) -> float | None:
    """Return s_r over the standard deviation that the fits state (root mean square over runs); None without."""
    halves = [half for half, used in zip(one.half_widths, one.is_repetition, strict=True) if used and half]
    if not halves or one.scatter is None or one.scatter.repeatability is None:
        return None
    return one.scatter.repeatability * Z95 / sqrt(sum(half**2 for half in halves) / len(halves))
