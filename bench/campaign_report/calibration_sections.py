"""Sections on the calibration of a campaign: state of the channels, and intervals with its uncertainty."""

from collections.abc import Iterator, Sequence

from bench.calibration import GAIN_FORMULA
from bench.campaign_report.calibration import group_certificates, group_warnings
from bench.campaign_report.content import CampaignReport, Cell
from bench.campaigns import RunFact
from bench.report import Finding
from bench.report.layout import Section, Table

_RUNS_PER_TABLE = 3
"""Largest number of runs in one table, so that it fits on a page of paper."""


def make_calibration(report: CampaignReport) -> Section:
    """Make the section on certificates, overdue channels and failed checks at the start of the runs."""
    found = report.calibrations
    rows = [(*row, name_runs(report, runs)) for row, runs in group_certificates(found).items()]
    header = ("Channel", "Certificate", "Date", "Due", "Uncertainty", "Gain error", "State", "Runs")
    certificates = Table(rows, header, (3, 4, 3, 3, 3, 2, 2, 3), "Certificates at the start of the runs")
    warned = [(text, name_runs(report, runs)) for text, runs in group_warnings(found).items()]
    warnings = Table(warned, ("Deficiency", "Runs"), (6, 2), "Overdue channels and failed checks")
    return Section(
        "Calibration", list(_describe_gaps(report)), [one for one in (certificates, warnings) if one.rows]
    )


def _describe_gaps(report: CampaignReport) -> Iterator[str]:
    """Yield a sentence on runs without certificates, and one on runs whose log cannot be read."""
    without = [run for run, one in report.calibrations.items() if one.is_known and not one.certificates]
    unread = [run for run, one in report.calibrations.items() if not one.is_known]
    if without:
        yield f"The logs of these runs name no certificate: run {name_runs(report, without)}."
    if unread:
        names = name_runs(report, unread)
        yield f"The logs of these runs cannot be read, so that only deficiencies are known: run {names}."
    if not any(one.warnings for one in report.calibrations.values()):
        yield "No channel was overdue, and no check had failed."


def make_calibration_warnings(report: CampaignReport) -> list[Finding]:
    """Return a finding for each overdue channel and failed check, with the runs that it concerns."""
    found = group_warnings(report.calibrations)
    return [
        Finding("warning", f"{text.removesuffix('.')} (run {name_runs(report, runs)}).")
        for text, runs in found.items()
    ]


def name_runs(report: CampaignReport, runs: Sequence[str]) -> str:
    """Return the numbers of runs in the report, with ranges: `1–3, 5`."""
    numbers = sorted(report.numbers[run] for run in runs)
    ends = [number for number in numbers if number + 1 not in numbers]
    begins = [number for number in numbers if number - 1 not in numbers]
    return ", ".join(str(a) if a == b else f"{a}–{b}" for a, b in zip(begins, ends, strict=True))


def make_calibrated_results(report: CampaignReport) -> Section:
    """Make the section on the parameters of each run with the uncertainty of fit and calibration."""
    tables = [table for cell in report.cells for table in _make_tables(report, cell)]
    if not tables:
        text = (
            "No run has both a fit of its own and certificates, so that there are no intervals with calibration."
        )
        return Section("Parameters with calibration", [text])
    note = "Value with its 95 % interval. In brackets: relative standard uncertainty from the calibration."
    return Section("Parameters with calibration", [note, GAIN_FORMULA], tables)


def _make_tables(report: CampaignReport, cell: Cell) -> Iterator[Table]:
    facts = [fact for fact in cell.facts if report.calibrations[fact.run].intervals]
    for start in range(0, len(facts), _RUNS_PER_TABLE):
        part = facts[start : start + _RUNS_PER_TABLE]
        found = [report.calibrations[fact.run].intervals for fact in part]
        units = {name: row.unit for rows in reversed(found) for name, row in rows.items()}
        rows = [(name, unit, *(_format(report, fact, name) for fact in part)) for name, unit in units.items()]
        header = ("Parameter", "Unit", *(f"Run {report.numbers[fact.run]}" for fact in part))
        shown = ", ".join(str(report.numbers[fact.run]) for fact in part)
        title = f"Intervals with calibration, {cell.title}: run {shown}"
        yield Table(rows, header, (2, 2, *(5 for _ in part)), title)


def _format(report: CampaignReport, fact: RunFact, name: str) -> str:
    row = report.calibrations[fact.run].intervals.get(name)
    return "–" if row is None else f"{row.value} ({row.calibration})"
