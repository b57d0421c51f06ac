"""Page of a report: one self-contained HTML file."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.calibration import GAIN_FORMULA
from bench.errors import ReportError
from bench.log import Log, read_log
from bench.report import content, diagnosis, diagnosis_plots, plots
from bench.report.calibration import (
    make_calibration_findings,
    make_calibration_rows,
    make_combined_rows,
)
from bench.report.diagnosis import Diagnosis, read_diagnosis
from bench.report.documents import Fit, Prediction, read_fit, read_prediction
from bench.report.layout import Picture, make_environment, render_png
from bench.report.recording import Recording, make_recording
from bench.report.series import predict
from bench.report.summary import make_findings
from bench.report.truth import Truth, judge, make_answer_rows, make_truth_rows, read_truth
from bench.report.values import format_force, format_percent, format_rounded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONS = {
    "loops": (
        "Force against displacement and velocity",
        "One steady cycle at each drive, or a few seconds if the drive varies.",
    ),
    "time": ("Force against time", "Steady cycles at each drive, overlaid."),
    "residual": (
        "Force error",
        "Simulated minus recorded force over the whole recording: lowest and highest value of each short interval."
        " Noise alone extends slightly beyond twice the noise floor.",
    ),
    "drives": ("Force error by drive", "Root mean square over all samples at each drive, with the noise floor."),
    "gap": (
        "Sim-to-real gap and its origin",
        "Left: force error on held-out strokes. Right: stages of the chain from the coil to the recording.",
    ),
    "where": (
        "Gap map",
        "Error of the refitted law beyond the noise, by condition and phase of the stroke.",
    ),
    "discovery": (
        "Curve of the effect outside the library",
        "Estimate with its 95 % band, without the factors of further variables."
        " A part that the law can absorb, such as a straight line over force, is not determined.",
    ),
    "recording": (
        "The whole recording",
        "Displacement, drive and force; colours by drive as in the other plots.",
    ),
}
"""Title and caption of each plot."""


@dataclass(frozen=True)
class Report:
    """Content of a page."""

    log: Log
    sha256: str
    fit: Fit | None
    prediction: Prediction | None
    recording: Recording
    diagnosis: Diagnosis | None = None
    truth: Truth | None = None
    unseen: Prediction | None = None
    """The twin on a recording that no fit has read."""

    @property
    def is_fitted_log(self) -> bool:
        """True if the fit used this log."""
        return self.fit is not None and self.fit.has_fitted(self.sha256)


def gather(
    log: Path,
    fit: Path | None,
    diagnosis_path: Path | None = None,
    truth: Path | None = None,
    unseen: Path | None = None,
    series_path: Path | None = None,
) -> Report:
    """Read a log and the documents on it, and simulate the fit on the log.

    Args:
        log: recording.
        fit: fit document.
        diagnosis_path: diagnosis document.
        truth: truth file of a drawn damper, which is compared with the diagnosis.
        unseen: prediction document of the diagnosed twin on another recording.
        series_path: file that receives recorded and simulated force.

    Raises:
        ReportError: a document is invalid, or the fit cannot be simulated on this log.
        LogError: the log cannot be read.
    """
    fit_document = None if fit is None else read_fit(fit)
    diagnosis_document = None if diagnosis_path is None else read_diagnosis(diagnosis_path)
    content_of_log = read_log(log)
    prediction, series = (None, None) if fit is None else predict(fit, log, series_path)
    with log.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    recording = make_recording(content_of_log, series)
    return Report(
        content_of_log,
        sha256,
        fit_document,
        prediction,
        recording,
        diagnosis_document,
        None if truth is None else read_truth(truth),
        None if unseen is None else read_prediction(unseen),
    )


def make_figures(report: Report) -> dict[str, Figure]:
    """Make the plots of a report by name, in the order of the page."""
    figures = {"loops": plots.plot_loops(report.recording), "time": plots.plot_over_time(report.recording)}
    if report.prediction is not None:
        floor = report.prediction.noise_floor_n
        figures["residual"] = plots.plot_residual(report.recording, floor)
        figures["drives"] = plots.plot_error_by_drive(report.prediction.per_drive, floor, report.recording)
    if report.diagnosis is not None:
        figures["gap"] = diagnosis_plots.plot_shrinkage(report.diagnosis)
        if (where := diagnosis_plots.plot_gap_map(report.diagnosis, report.recording.drive_unit)) is not None:
            figures["where"] = where
        curves = diagnosis_plots.plot_discovery(report.diagnosis, report.recording.drive_unit)
        if curves is not None:
            figures["discovery"] = curves
    return {**figures, "recording": plots.plot_recording(report.recording)}


def render(report: Report, figures: dict[str, Figure], command: str, created_at: datetime) -> str:
    """Render the page.

    Args:
        report: content of the page.
        figures: plots, from `make_figures`.
        command: command line that wrote the page.
        created_at: time at which the page is written.
    """
    values = make_context(report, command, created_at)
    template = make_environment("bench.report").get_template("report.html")
    return template.render(pictures=make_pictures(figures), **values)


def make_pictures(figures: dict[str, Figure]) -> dict[str, Picture]:
    """Render the plots of a report with their titles and captions."""
    return {name: Picture(*CAPTIONS[name], render_png(figure)) for name, figure in figures.items()}


def make_context(report: Report, command: str, created_at: datetime) -> dict[str, Any]:
    """Return all texts and tables of a report, formatted for a person, for a template or another format.

    Args:
        report: content of the report.
        command: command line that writes it.
        created_at: time at which it is written.
    """
    found = report.diagnosis
    return {
        "title": _make_title(report.log),
        "run": content.make_header_rows(report.log, report.sha256),
        "findings": [
            *make_calibration_findings(report.log.metadata),
            *make_findings(report.log, report.fit, report.prediction, report.is_fitted_log),
        ],
        "outcome": content.make_outcome_rows(report.log),
        "channels": content.make_channel_rows(report.log),
        "calibration": make_calibration_rows(report.log.metadata),
        "diagnosis": None if found is None else diagnosis.make_context(found, report.recording.drive_unit),
        "truth": _make_truth_context(report),
        "fit": None if report.fit is None else _make_fit_context(report),
        "created_at": f"{created_at:%Y-%m-%d %H:%M} UTC",
        "version": version("mrbench"),
        "command": command,
    }


def _make_title(log: Log) -> str:
    specimen = log.metadata["run"].get("specimen", "")
    return log.path.stem if specimen in ("", "unknown") else specimen


def _make_truth_context(report: Report) -> dict[str, object] | None:
    """Return the truth of a drawn damper next to the answer; None where one of the two is missing."""
    if report.truth is None or report.diagnosis is None:
        return None
    rows = [*make_answer_rows(report.diagnosis, report.unseen), *make_truth_rows(report.truth)]
    return {"rows": rows, "judgement": judge(report.diagnosis, report.truth)}


def _make_fit_figures(prediction: Prediction, is_fitted_log: bool) -> list[tuple[str, str]]:
    return [
        (format_force(prediction.rmse_n), "force error (RMSE)"),
        (format_force(prediction.noise_floor_n), "noise floor of the force"),
        (format_percent(prediction.nrmse), "of the force's standard deviation (NRMSE)"),
        ("fitted" if is_fitted_log else "not used", "use of this recording in the fit"),
    ]


def _make_fit_context(report: Report) -> dict[str, object]:
    """Return the values of a fit for the page's template."""
    fit, prediction = report.fit, report.prediction
    if fit is None or prediction is None:
        raise ReportError("a report on a fit needs its prediction on the log; give both")
    return {
        "key_figures": _make_fit_figures(prediction, report.is_fitted_log),
        "drives": content.make_drive_rows(prediction.per_drive, prediction.noise_floor_n),
        "samples": prediction.samples,
        "bias": f"{format_rounded(prediction.bias_n, prediction.rmse_n / math.sqrt(prediction.samples))} N",
        "freed": ", ".join(prediction.freed),
        "coordinates": content.make_parameter_rows(fit.coordinates, "coordinates"),
        "parameters": content.make_parameter_rows(fit.parameters, "parameters"),
        "combined": make_combined_rows(report.log.metadata, fit, report.sha256),
        "formula": GAIN_FORMULA,
        "errors": _make_error_rows(fit),
        "floor": content.make_floor_rows(fit),
        "nuisances": content.make_nuisance_rows(fit),
        "correlations": content.make_correlation_rows(fit),
        "provenance": content.make_provenance_rows(fit),
    }


def _make_error_rows(fit: Fit) -> list[tuple[str, str, str]]:
    """Make the rows of the fit's force error on fitted and held-out samples."""
    rows = [("fitted", format_force(fit.rmse_n.train), format_percent(fit.nrmse.train))]
    if fit.rmse_n.held_out is not None and fit.nrmse.held_out is not None:
        rows.append(("held out", format_force(fit.rmse_n.held_out), format_percent(fit.nrmse.held_out)))
    return rows
