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
    Fit,
    Prediction,
    format_force,
    format_quantity,
    format_ratio,
    judge,
    make_answer_rows,
    make_truth_rows,
    read_diagnosis,
    read_fit,
    read_prediction,
    read_truth,
)


def print_answer(demo: DemoFolder, console: Console) -> None:
    """Print errors, parameters, and the answer of the diagnosis.

    Raises:
        ReportError: a file is not a valid document.
    """
    fit, unseen = read_fit(demo.fit), _read_unseen(demo)
    for table in (_make_error_table(fit, unseen), _make_parameter_table(fit)):
        console.print(table)
    for path in filter(None, (demo.log, demo.validation_log)):
        if message := describe_late_setpoints(read_log(path).events):
            console.print(f"{path.name}: {message}\n", highlight=False)
    diagnosis = read_diagnosis(demo.diagnosis)
    console.print(f"{diagnosis.explanation}\n", highlight=False)
    _print_rows("Answer of the diagnosis", make_answer_rows(diagnosis, unseen), console)


def print_truth(demo: DemoFolder, console: Console) -> None:
    """Open the truth file; print the true effect, and whether the diagnosis named it.

    Raises:
        ReportError: a file is not a valid document.
    """
    truth = read_truth(demo.truth)
    _print_rows("Truth, opened only now", make_truth_rows(truth), console)
    console.print(judge(read_diagnosis(demo.diagnosis), truth).text, style="bold", highlight=False)
    console.print(f"Another hidden effect: mrbench demo --seed {demo.seed + 1}\n", highlight=False)


def print_files(demo: DemoFolder, console: Console) -> None:
    """Print the files of a demonstration."""
    for name, path, note in _list_files(demo):
        console.print(f"  {name:<15} {path}  {note}".rstrip(), highlight=False, soft_wrap=True)


def print_way_to_page(console: Console) -> None:
    """Print how the page stays open, because it closes with the demo."""
    text = "The page has closed with the demo. mrbench demo --serve keeps it open, with three recorded runs."
    console.print(f"\n{text}", highlight=False, soft_wrap=True)


def _read_unseen(demo: DemoFolder) -> Prediction | None:
    return None if demo.prediction is None else read_prediction(demo.prediction)


def _print_rows(title: str, rows: Sequence[tuple[str, str]], console: Console) -> None:
    """Print a title and one line for each row, unbroken, so that a script can read them."""
    console.print(title, style="bold", highlight=False)
    for name, text in rows:
        console.print(f"  {name}: {text}", highlight=False, soft_wrap=True)
    console.print()


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


def _make_error_table(fit: Fit, unseen: Prediction | None) -> Table:
    rows = [("fitted, law alone", fit.rmse_n.train, fit.noise_floor_n)]
    if unseen is not None:
        if unseen.before_n is not None:
            rows.append(("validation, law alone", unseen.before_n, unseen.noise_floor_n))
        rows.append(("validation, twin", unseen.rmse_n, unseen.noise_floor_n))
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
    files += [("diagnosis", demo.diagnosis, ""), ("twin", demo.twin, "(mrbench sim --scenario plays it)")]
    if demo.validation_log is not None and demo.prediction is not None:
        files += [("validation", demo.validation_log, ""), ("prediction", demo.prediction, "")]
    return [*files, ("truth", demo.truth, "(the hidden effect)")]
