"""Findings at the top of a campaign report, and its key figures."""

from bench.campaign_report.calibration_sections import make_calibration_warnings
from bench.campaign_report.content import CampaignReport, Cell
from bench.campaign_report.record import NOT_DONE, format_duration
from bench.campaign_report.results import compute_fit_ratio
from bench.report import Finding, format_name, format_significant

_SCATTER_RATIO = 2.0
"""Ratio of the scatter to the fits' own standard deviation, above which it is named as a deficiency."""


def make_findings(report: CampaignReport) -> list[Finding]:
    """Return the findings on a campaign."""
    found = [_describe_state(report), *_describe_steps(report), *_describe_identification(report)]
    found += make_calibration_warnings(report)
    for cell in report.cells:
        found += [*_describe_drift(cell), *_describe_outliers(cell), *_describe_scatter(cell)]
    return found


def make_key_figures(report: CampaignReport) -> list[tuple[str, str]]:
    """Return value and name of the key figures."""
    items, facts = report.view.items, report.state.facts
    identified = sum(bool(report.get_result(fact).parameters) for fact in facts)
    return [
        (f"{sum(item.state == 'done' for item in items)} of {len(items)}", "steps done"),
        (str(len(facts)), "complete runs"),
        (str(identified), "identified runs"),
        (format_duration(report.view.times.stroking_s), "in motion"),
    ]


def _describe_state(report: CampaignReport) -> Finding:
    view = report.view
    reason = f": {view.reason}" if view.reason else ""
    if view.status == "done":
        return Finding("good", f"The campaign is done{reason}.")
    if report.state.has_ended:
        return Finding("warning", f"The campaign was stopped{reason}.")
    return Finding(
        "warning",
        f"The campaign is not finished, its state is {view.status}{reason}. This report is on its latest state.",
    )


def _describe_steps(report: CampaignReport) -> list[Finding]:
    counts = {state: sum(item.state == state for item in report.view.items) for state in NOT_DONE}
    named = [f"{count} {format_name(state)}" for state, count in counts.items() if count]
    return [Finding("warning", f"Steps that were not done: {', '.join(named)}.")] if named else []


def _describe_identification(report: CampaignReport) -> list[Finding]:
    facts = report.state.facts
    missing = [report.numbers[fact.run] for fact in facts if not report.get_result(fact).parameters]
    if not facts or not missing:
        return []
    if len(missing) == len(facts):
        return [Finding("warning", "No run has been identified: identify the runs, and make the report again.")]
    return [Finding("warning", f"Without a fit: run {', '.join(map(str, missing))}.")]


def _describe_drift(cell: Cell) -> list[Finding]:
    lines = {one.trend.parameter: one.drift_per_run for one in cell.series if one.drift_per_run is not None}
    if not lines:
        return []
    names = [name for name, line in lines.items() if line.is_significant]
    if not names:
        return [Finding("good", f"{cell.title}: no parameter drifts significantly.")]
    text = f"{cell.title}: {len(names)} of {len(lines)} parameters drift over the runs: {', '.join(names)}."
    return [Finding("warning", text)]


def _describe_outliers(cell: Cell) -> list[Finding]:
    found = [
        f"{one.trend.parameter} in run {', '.join(map(str, one.outliers))}" for one in cell.series if one.outliers
    ]
    return [Finding("warning", f"{cell.title}: outliers are {'; '.join(found)}.")] if found else []


def _describe_scatter(cell: Cell) -> list[Finding]:
    ratios = {one.trend.parameter: ratio for one in cell.series if (ratio := compute_fit_ratio(one)) is not None}
    if not ratios:
        return []
    name, largest = max(ratios.items(), key=lambda entry: entry[1])
    text = (
        f"{cell.title}: in one mounting, runs scatter at most {format_significant(largest, 2)} times as much as"
        f" their own intervals say ({name})."
    )
    return [Finding("warning" if largest > _SCATTER_RATIO else "good", text)]
