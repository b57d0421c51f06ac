"""The demonstration: recorded, identified, predicted and reported by the commands that a person would type."""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from bench.errors import ReportError
from bench.report.documents import Fit, Prediction, read_fit, read_prediction
from bench.report.values import newton, quantity, times

SCENARIO = "default"


@dataclass(frozen=True)
class Demo:
    """What is recorded, and where everything goes."""

    folder: Path
    method: str
    """Identified."""
    unseen: str | None
    """Method of a second recording that the fit never sees; none to leave it out."""

    @property
    def log(self) -> Path:
        """The recording that is identified."""
        return self.folder / f"{self.method}.mcap"

    @property
    def unseen_log(self) -> Path | None:
        """The recording that is only predicted."""
        return None if self.unseen is None else self.folder / f"{self.unseen}.mcap"

    @property
    def fit(self) -> Path:
        """The identified damper."""
        return self.folder / "fit.json"

    @property
    def prediction(self) -> Path:
        """How well the fit repeats the unseen strokes."""
        return self.folder / "prediction.json"

    @property
    def report(self) -> Path:
        """The page."""
        return self.folder / "report.html"

    @property
    def plots(self) -> Path:
        """The page's pictures."""
        return self.folder / "plots"

    def steps(self) -> list[tuple[str, list[str]]]:
        """What each step does, and the words of its `mrbench` command."""
        steps = [self._recording(self.method, self.log)]
        steps.append(("identify the damper", ["identify", str(self.log), "--out", str(self.fit)]))
        if self.unseen is not None and self.unseen_log is not None:
            steps.append(self._recording(self.unseen, self.unseen_log))
            words = ["predict", str(self.fit), str(self.unseen_log), "--out", str(self.prediction)]
            steps.append(("predict the strokes that the fit never saw", words))
        report = ["report", str(self.log), "--fit", str(self.fit), "--out", str(self.report)]
        return [*steps, ("write the report", [*report, "--plots", str(self.plots)])]

    @staticmethod
    def _recording(method: str, log: Path) -> tuple[str, list[str]]:
        return (
            f"record {method} from the simulated rig",
            ["run", method, "--scenario", SCENARIO, "--out", str(log)],
        )


def carry_out(demo: Demo, says: Console) -> bool:
    """Call one command after the other, each as a process with its own progress.

    Args:
        demo: what to do.
        says: where each step is announced.

    Returns:
        Whether all went well; a step that fails has said why on standard error, and ends the demo.

    Raises:
        ReportError: the folder cannot be made.
    """
    try:
        demo.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReportError(f"{demo.folder}: cannot be made ({error.strerror}); give another --out") from error
    steps = demo.steps()
    for number, (what, words) in enumerate(steps, 1):
        says.print(f"{number}/{len(steps)} {what}", highlight=False)
        if subprocess.run([sys.executable, "-m", "bench.cli", *words], check=False).returncode != 0:
            return False
    return True


def summarise(demo: Demo, console: Console) -> None:
    """Say in short what came out, all of it from the files just written.

    Raises:
        ReportError: a file is not what its command should have written.
    """
    fit = read_fit(demo.fit)
    prediction = read_prediction(demo.prediction) if demo.unseen is not None else None
    for table in (_error_table(fit, prediction), _parameter_table(fit)):
        console.print(table)
    for name, path, how in _files(demo):
        console.print(f"  {name:<15} {path}  {how}".rstrip(), highlight=False, soft_wrap=True)


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


def _files(demo: Demo) -> list[tuple[str, Path, str]]:
    files = [
        ("report", demo.report, "(open in a browser)"),
        ("plots", demo.plots, "(SVG and PNG)"),
        ("fit", demo.fit, "(the paper's fourteen parameters are in it, too)"),
        ("recording", demo.log, "(open in Foxglove, Lichtblick or PlotJuggler; plot /bench/sample)"),
    ]
    if demo.unseen_log is not None:
        files += [("unseen strokes", demo.unseen_log, ""), ("prediction", demo.prediction, "")]
    return files
