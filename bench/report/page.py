"""The report's page: one HTML file that needs nothing else."""

import base64
import hashlib
import math
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from bench.errors import ReportError
from bench.recorder.reader import Log, read_log
from bench.report import content, diagnosis, diagnosis_plots, plots
from bench.report.diagnosis import Diagnosis, read_diagnosis
from bench.report.documents import Fit, Prediction, read_fit
from bench.report.recording import Recording, recording_from
from bench.report.series import predict
from bench.report.summary import findings
from bench.report.values import newton, percent, rounded

CAPTIONS = {
    "loops": (
        "Force against displacement and velocity",
        "One steady cycle at each drive, or a few seconds where the drive varies.",
    ),
    "time": ("Force against time", "Steady cycles at each drive, laid upon each other."),
    "residual": (
        "What the law leaves",
        "Simulated minus recorded force over the whole recording: lowest and highest of each short stretch of "
        "time. Noise alone, too, reaches a little beyond twice its floor.",
    ),
    "drives": ("Force error by drive", "Root mean square over all samples at that drive, beside the noise floor."),
    "gap": (
        "How far it shrinks, and where it comes from",
        "Left: force error on strokes that no fit saw. Right: stages of the chain from the coil to the record.",
    ),
    "where": (
        "Where it shows",
        "What the refitted law leaves beyond the noise, by condition and phase of the stroke.",
    ),
    "whole": (
        "The whole recording",
        "Displacement, drive and force; colours by drive as everywhere on this page.",
    ),
}


@dataclass(frozen=True)
class Picture:
    """One figure in the page."""

    title: str
    caption: str
    data: str
    """PNG in base64."""


@dataclass(frozen=True)
class Report:
    """Everything that a page is made from."""

    log: Log
    sha256: str
    fit: Fit | None
    prediction: Prediction | None
    recording: Recording
    diagnosis: Diagnosis | None = None

    @property
    def seen(self) -> bool:
        """Whether the fit was made from this log."""
        return self.fit is not None and self.fit.saw(self.sha256)


def gather(log: Path, fit: Path | None, diagnosed: Path | None = None) -> Report:
    """Read a log, a fit and a diagnosis, and simulate the fit on the log.

    Raises:
        ReportError: the fit or the diagnosis is none, or the fit cannot be simulated on this log.
        LogError: the log cannot be read.
    """
    known = None if fit is None else read_fit(fit)
    answer = None if diagnosed is None else read_diagnosis(diagnosed)
    recorded = read_log(log)
    prediction, series = (None, None) if fit is None else predict(fit, log)
    with log.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return Report(recorded, digest, known, prediction, recording_from(recorded, series), answer)


def figures(report: Report) -> dict[str, Figure]:
    """The pictures of a report by name, in the order of the page."""
    found = {"loops": plots.loops(report.recording), "time": plots.over_time(report.recording)}
    if report.prediction is not None:
        floor = report.prediction.noise_floor_n
        found["residual"] = plots.residual(report.recording, floor)
        found["drives"] = plots.by_drive(report.prediction.per_drive, floor, report.recording)
    if report.diagnosis is not None:
        found["gap"] = diagnosis_plots.shrinkage(report.diagnosis)
        if (where := diagnosis_plots.place(report.diagnosis, report.recording.drive_unit)) is not None:
            found["where"] = where
    return {**found, "whole": plots.whole(report.recording)}


def render(report: Report, drawn: dict[str, Figure], command: str, made: datetime) -> str:
    """The page.

    Args:
        report: what it is about.
        drawn: its pictures, as of `figures`.
        command: the command line that made it.
        made: when.
    """
    environment = Environment(
        loader=PackageLoader("bench.report", "."),
        autoescape=True,
        undefined=StrictUndefined,  # a name that the page misses is an error, not a gap
        trim_blocks=True,
        lstrip_blocks=True,
    )
    pictures = {
        name: Picture(*CAPTIONS[name], base64.b64encode(plots.png(figure)).decode())
        for name, figure in drawn.items()
    }
    answer = report.diagnosis
    return environment.get_template("report.html").render(
        title=_title(report.log),
        run=content.header_facts(report.log, report.sha256),
        findings=findings(report.log, report.fit, report.prediction, report.seen),
        pictures=pictures,
        outcome=content.outcome_facts(report.log),
        channels=content.channel_rows(report.log),
        diagnosis=None if answer is None else diagnosis.context(answer, report.recording.drive_unit),
        fit=None if report.fit is None else _fit_context(report),
        made=f"{made:%Y-%m-%d %H:%M} UTC",
        version=version("mrbench"),
        command=command,
    )


def _title(log: Log) -> str:
    specimen = log.metadata["run"].get("specimen", "")
    return log.path.stem if specimen in ("", "unknown") else specimen


def _fit_context(report: Report) -> dict[str, object]:
    """What the page shows of a fit."""
    fit, prediction = report.fit, report.prediction
    if fit is None or prediction is None:
        raise ReportError("a fit is shown only with its prediction on the log; make both")
    return {
        "key_figures": [
            (newton(prediction.rmse_n), "force error (RMSE)"),
            (newton(prediction.noise_floor_n), "noise floor of the force"),
            (percent(prediction.nrmse), "of the force's standard deviation"),
            ("fitted" if report.seen else "never seen", "this recording, by the fit"),
        ],
        "drives": content.drive_rows(prediction.per_drive, prediction.noise_floor_n),
        "samples": prediction.samples,
        "bias": f"{rounded(prediction.bias_n, prediction.rmse_n / math.sqrt(prediction.samples))} N",
        "freed": ", ".join(prediction.freed),
        "coordinates": content.parameter_rows(fit.coordinates, "coordinates"),
        "parameters": content.parameter_rows(fit.parameters, "parameters"),
        "errors": _split_errors(fit),
        "floor": content.floor_facts(fit),
        "nuisances": content.nuisance_facts(fit),
        "correlations": content.correlation_facts(fit),
        "provenance": content.provenance_facts(fit),
    }


def _split_errors(fit: Fit) -> list[tuple[str, str, str]]:
    """Force error of the fit on what it saw and what was held out."""
    rows = [("fitted", newton(fit.rmse_n.train), percent(fit.nrmse.train))]
    if fit.rmse_n.held_out is not None and fit.nrmse.held_out is not None:
        rows.append(("held out", newton(fit.rmse_n.held_out), percent(fit.nrmse.held_out)))
    return rows
