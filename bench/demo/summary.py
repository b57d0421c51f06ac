"""Summary of a demonstration, from the files that it wrote."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from bench.demo.folder import DemoFolder
from bench.log import read_log
from bench.report import (
    VERDICTS,
    Fit,
    Prediction,
    format_force,
    format_quantity,
    format_ratio,
    read_diagnosis,
    read_fit,
    read_prediction,
)


def summarise(demo: DemoFolder, console: Console) -> None:
    """Print errors, parameters, diagnosis and files.

    Raises:
        ReportError: a file is not a valid document.
    """
    fit = read_fit(demo.fit)
    prediction = read_prediction(demo.prediction) if demo.validation_method is not None else None
    for table in (_make_error_table(fit, prediction), _make_parameter_table(fit)):
        console.print(table)
    if demo.diagnosis is not None:
        diagnosis = read_diagnosis(demo.diagnosis)
        console.print(f"{VERDICTS[diagnosis.verdict]} {diagnosis.explanation}\n", highlight=False)
    for path in filter(None, (demo.log, demo.validation_log)):
        if message := describe_late_setpoints(read_log(path).events):
            console.print(f"{path.name}: {message}\n", highlight=False)
    for name, path, note in _list_files(demo):
        console.print(f"  {name:<15} {path}  {note}".rstrip(), highlight=False, soft_wrap=True)


def describe_late_setpoints(events: Sequence[Mapping[str, Any]]) -> str:
    """Describe the effect of late setpoints on a recording; empty if none was late enough for an alarm."""
    late = [event for event in events if event.get("quantity") == "setpoint_lateness"]
    if all(event["kind"] != "alarm" for event in late):
        return ""
    worst = max(event["value"] for event in late)
    return (
        f"setpoints were up to {1e3 * worst:.0f} ms late because this machine was busy, and the motion was "
        "disturbed. Samples whose motion is not known are excluded from fit and prediction."
    )


def _make_error_table(fit: Fit, prediction: Prediction | None) -> Table:
    rows = [("fitted", fit.rmse_n.train, fit.noise_floor_n)]
    if prediction is not None:
        rows.append(("validation", prediction.rmse_n, prediction.noise_floor_n))
    table = _make_table(f"Force error of {fit.specimen}", ["strokes", "RMSE", "noise floor", "RMSE over floor"])
    for strokes, rmse, floor in rows:
        table.add_row(strokes, format_force(rmse), format_force(floor), format_ratio(rmse / floor))
    return table


def _make_parameter_table(fit: Fit) -> Table:
    table = _make_table("Parameters with 95 % intervals", ["", "value", "unit", ""])
    for name, estimate in fit.coordinates.items():
        quantity = format_quantity(estimate.value, estimate.ci95, estimate.unit)
        note = "" if estimate.identifiable else "not determined by these strokes"
        table.add_row(name, quantity.value, quantity.unit, note)
    return table


def _make_table(title: str, headings: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, pad_edge=False)
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


def _list_files(demo: DemoFolder) -> list[tuple[str, Path, str]]:
    files = [
        ("report", demo.report, "(open in a browser)"),
        ("plots", demo.plots, "(SVG and PNG)"),
        ("fit", demo.fit, "(also contains the paper's fourteen parameters)"),
        ("recording", demo.log, "(open in Foxglove, Lichtblick or PlotJuggler; plot /bench/sample)"),
    ]
    if demo.diagnosis is not None:
        files.append(("diagnosis", demo.diagnosis, ""))
    if demo.validation_log is not None:
        files += [("validation", demo.validation_log, ""), ("prediction", demo.prediction, "")]
    return files
