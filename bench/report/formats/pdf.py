"""Report as PDF, with the texts, tables and plots of the page."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bench.report.layout import Picture, Section, Table, write_document


def write_pdf(context: Mapping[str, Any], pictures: Mapping[str, Picture], path: Path) -> None:
    """Write a report.

    Args:
        context: values of the page's template.
        pictures: plots by their names.
        path: file to write.

    Raises:
        ReportError: the file cannot be written.
    """
    write_document(str(context["title"]), "damper report", _list_sections(context), pictures, path)


def _list_sections(context: Mapping[str, Any]) -> Iterator[Section]:
    """Yield the sections in the order of the page."""
    yield Section("The run", tables=[Table(context["run"])])
    yield _make_summary(context)
    if context["diagnosis"]:
        yield _make_diagnosis(context["diagnosis"])
    if context["truth"]:
        truth = context["truth"]
        yield Section("The hidden effect, disclosed", [truth["judgement"].text], [Table(truth["rows"])])
    yield Section("", pictures=["discovery", "loops", "time", "residual"])
    if context["fit"]:
        yield from _make_fit_sections(context["fit"])
    channels = Table(context["channels"], ("Channel", "Unit", "Rate", "Filter", "Delay"), (2, 1, 1, 3, 1))
    yield Section("The recording", tables=[Table(context["outcome"]), channels], pictures=["recording"])
    if context["calibration"]:
        names = ("Channel", "Certificate", "Date", "Due", "Gain uncertainty", "Gain error", "At the start")
        yield Section("Calibration", tables=[Table(context["calibration"], names, (2, 3, 2, 2, 2, 2, 1))])
    origin = f"Created {context['created_at']} with mrbench {context['version']}: {context['command']}"
    made_by = [Table(context["fit"]["provenance"])] if context["fit"] else []
    yield Section("Provenance", [origin], made_by)


def _make_summary(context: Mapping[str, Any]) -> Section:
    figures = context["fit"]["key_figures"] if context["fit"] else []
    tables = [Table([(name, value) for value, name in figures])] if figures else []
    return Section("Summary", [f"• {finding.text}" for finding in context["findings"]], tables)


def _make_diagnosis(diagnosis: Mapping[str, Any]) -> Section:
    effects = [
        (row.name, row.stage, "\n".join(row.values), row.share, row.probability) for row in diagnosis["effects"]
    ]
    tables = [
        Table(diagnosis["gap"]),
        Table(
            effects, ("Effect", "Stage", "Size, 95 % interval", "Share of the gap", "Probability"), (2, 2, 4, 2, 2)
        ),
        Table([("Explanation", "Probability"), *diagnosis["sets"]]),
    ]
    outside = diagnosis["discovery"]["text"] if diagnosis["discovery"] else ""
    following = f"Proposed next stroke: a {diagnosis['next']}" if diagnosis["next"] else ""
    texts = [f"{diagnosis['verdict']} {diagnosis['explanation']}", outside, following, diagnosis["cross_check"]]
    pictures = ["gap", "where"]
    return Section("Diagnosis of the sim-to-real gap", [*texts, *diagnosis["notes"]], tables, pictures)


def _make_fit_sections(fit: Mapping[str, Any]) -> Iterator[Section]:
    drives = [
        (row.drive, row.rmse, row.over_floor, row.nrmse, str(row.samples), row.note) for row in fit["drives"]
    ]
    header = ("Drive", "RMSE", "Over the floor", "NRMSE", "Samples", "")
    errors = Table(fit["errors"], ("The fit on its recordings", "RMSE", "NRMSE"), (2, 1, 1))
    tables = [Table(drives, header, (1, 1, 1, 1, 1, 1)), errors]
    yield Section("Force error by drive", tables=tables, pictures=["drives"])
    names = ("Parameter", "Value, 95 % interval", "Unit", "Meaning, certainty")
    for title, form in (
        ("Regular coordinates", "coordinates"),
        ("The modified Bouc-Wen parameters", "parameters"),
    ):
        rows = [
            (row.name, row.value, row.unit, ", ".join(filter(None, (row.meaning, row.certainty, row.note))))
            for row in fit[form]
        ]
        yield Section(title, tables=[Table(rows, names, (1, 2, 1, 4))])
    if fit["combined"]:
        heads = ("Parameter", "Value, 95 % interval", "Unit", "From calibration")
        table = Table(fit["combined"], heads, (1, 3, 1, 2))
        yield Section("Intervals with calibration", [fit["formula"]], [table])
    pairs = fit["correlations"] or [("Strongly correlated pairs", "none beyond ±0.9")]
    yield Section("Uncertainty", tables=[Table(fit["floor"]), Table(fit["nuisances"]), Table(pairs)])
