"""What came out of a demo, in short: all of it from the files that it has left."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from bench.demo.folder import DemoFolder
from bench.recorder.reader import read_log
from bench.report.diagnosis import VERDICTS, read_diagnosis
from bench.report.documents import Fit, Prediction, read_fit, read_prediction
from bench.report.values import newton, quantity, times


def summarise(demo: DemoFolder, console: Console) -> None:
    """Say in short what came out, all of it from the files just written.

    Raises:
        ReportError: a file is not what its command should have written.
    """
    fit = read_fit(demo.fit)
    prediction = read_prediction(demo.prediction) if demo.unseen is not None else None
    for table in (_error_table(fit, prediction), _parameter_table(fit)):
        console.print(table)
    if demo.diagnosis is not None:
        diagnosis = read_diagnosis(demo.diagnosis)
        console.print(f"{VERDICTS[diagnosis.verdict]} {diagnosis.explanation}\n", highlight=False)
    for path in filter(None, (demo.log, demo.unseen_log)):
        if words := held_up(read_log(path).events):
            console.print(f"{path.name}: {words}\n", highlight=False)
    for name, path, how in _files(demo):
        console.print(f"  {name:<15} {path}  {how}".rstrip(), highlight=False, soft_wrap=True)


def held_up(events: Sequence[Mapping[str, Any]]) -> str:
    """What a busy machine did to a recording, from the log's events; empty where it did nothing."""
    late = [event for event in events if event.get("quantity") == "setpoint_lateness"]
    if all(event["kind"] != "alarm" for event in late):
        return ""
    worst = max(event["value"] for event in late)
    return (
        f"this machine held the setpoints up, for {1e3 * worst:.0f} ms at worst. The rod stumbled there; where "
        "nobody knows how it moved, samples are left out of fit and prediction."
    )


def _error_table(fit: Fit, prediction: Prediction | None) -> Table:
    rows = [("fitted", fit.rmse_n.train, fit.noise_floor_n)]
    if prediction is not None:
        rows.append(("never seen", prediction.rmse_n, prediction.noise_floor_n))
    table = _table(f"Force error of {fit.specimen}", ["strokes", "RMSE", "noise floor", "RMSE over floor"])
    for which, rmse, floor in rows:
        table.add_row(which, newton(rmse), newton(floor), times(rmse / floor))
    return table


def _parameter_table(fit: Fit) -> Table:
    table = _table("Parameters with 95 % intervals", ["", "value", "unit", ""])
    for name, estimate in fit.coordinates.items():
        shown = quantity(estimate.value, estimate.ci95, estimate.unit)
        table.add_row(name, shown.value, shown.unit, "" if estimate.identifiable else "not fixed by these strokes")
    return table


def _table(title: str, headings: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, pad_edge=False)
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


def _files(demo: DemoFolder) -> list[tuple[str, Path, str]]:
    files = [
        ("report", demo.report, "(open in a browser)"),
        ("plots", demo.plots, "(SVG and PNG)"),
        ("fit", demo.fit, "(the paper's fourteen parameters are in it, too)"),
        ("recording", demo.log, "(open in Foxglove, Lichtblick or PlotJuggler; plot /bench/sample)"),
    ]
    if demo.diagnosis is not None:
        files.append(("diagnosis", demo.diagnosis, ""))
    if demo.unseen_log is not None:
        files += [("unseen strokes", demo.unseen_log, ""), ("prediction", demo.prediction, "")]
    return files
