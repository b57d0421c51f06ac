"""Findings at the top of a report: force error, deficiencies, and quantities that cannot be determined."""

from typing import Literal, NamedTuple

from bench.log import Log
from bench.report.documents import DelayEstimate, Estimate, Fit, Prediction
from bench.report.values import format_drive, format_force, format_percent, format_quantity, format_significant

_AT_FLOOR_RATIO, _NEAR_FLOOR_RATIO = 1.05, 1.2
"""Thresholds on the force error over the noise floor: up to them, it counts as equal or close to the floor."""
_EXTRAPOLATION_SHARE = 0.02
"""Threshold on the extrapolated drive over the span of the fitted drives: below it, no warning is given."""


class Finding(NamedTuple):
    """One or two sentences with their severity."""

    severity: Literal["good", "plain", "warning"]
    text: str


def make_findings(log: Log, fit: Fit | None, prediction: Prediction | None, is_fitted_log: bool) -> list[Finding]:
    """Return the findings on a recording and a fit.

    Args:
        log: recording.
        fit: identified damper, or None for a report on the recording alone.
        prediction: fit simulated on this recording.
        is_fitted_log: whether the fit used this recording.
    """
    findings = [_describe_outcome(log)]
    if fit is None or prediction is None:
        return [*findings, Finding("plain", "No fit was given: this page shows only the recording.")]
    findings += [*_describe_origin(log, fit, is_fitted_log), _describe_error(prediction)]
    findings += _describe_held_out(fit, is_fitted_log) + _describe_convergence(fit) + _describe_drives(log, fit)
    return [*findings, *_describe_identifiability(fit), *_describe_delays(fit), _describe_calibration()]


def _describe_outcome(log: Log) -> Finding:
    """Describe the end of the recording."""
    metadata = log.metadata.get("outcome", {})
    outcome, reason = metadata.get("outcome", "unknown"), metadata.get("reason", "")
    if outcome == "clean":
        return Finding("good", "The recording is clean: no sample was lost.")
    meaning = {
        "lossy": "samples were lost",
        "truncated": "its end is missing",
        "incomplete": "the run was stopped before the end of the method",
    }.get(outcome, "its end is not documented")
    return Finding("warning", f"The recording is {outcome}: {meaning}{f' ({reason})' if reason else ''}.")


def _describe_origin(log: Log, fit: Fit, is_fitted_log: bool) -> list[Finding]:
    """Describe the recordings of the fit, if they are not this one alone."""
    names = ", ".join(fit.provenance.logs)
    specimen = log.metadata["run"].get("specimen", "")
    findings = []
    if not is_fitted_log:
        findings.append(
            Finding(
                "plain",
                f"The law was fitted to another recording ({names}). All simulated forces here are predictions for"
                " strokes that the fit did not use.",
            )
        )
    elif len(fit.provenance.logs) > 1:
        findings.append(Finding("plain", f"The law was fitted to {len(fit.provenance.logs)} recordings: {names}."))
    if fit.specimen and specimen and fit.specimen != specimen:
        findings.append(
            Finding("warning", f"The fit is of specimen “{fit.specimen}”, this recording of “{specimen}”.")
        )
    return findings


def _describe_error(prediction: Prediction) -> Finding:
    """Describe the force error relative to the noise floor."""
    ratio = prediction.rmse_n / prediction.noise_floor_n if prediction.noise_floor_n > 0 else float("inf")
    text = (
        f"The law reproduces the recorded force with an error of {format_force(prediction.rmse_n)} (RMSE, "
        f"{format_percent(prediction.nrmse)} of the force's standard deviation). "
        f"The noise floor of the recording is {format_force(prediction.noise_floor_n)}."
    )
    if ratio <= _AT_FLOOR_RATIO:
        return Finding("good", f"{text} No model could be noticeably better on this recording.")
    if ratio <= _NEAR_FLOOR_RATIO:
        return Finding("plain", f"{text} The error is {100 * (ratio - 1):.0f} % above the noise floor.")
    return Finding(
        "warning",
        f"{text} The error is {format_significant(ratio, 2)} times the noise floor: damper or bench have an effect"
        " that the fitted law lacks. `mrbench diagnose` searches for it.",
    )


def _describe_held_out(fit: Fit, is_fitted_log: bool) -> list[Finding]:
    if not is_fitted_log or fit.rmse_n.held_out is None or fit.nrmse.held_out is None:
        return []
    return [
        Finding(
            "plain",
            f"On held-out strokes the force error is {format_force(fit.rmse_n.held_out)} "
            f"({format_percent(fit.nrmse.held_out)}), on fitted strokes {format_force(fit.rmse_n.train)} "
            f"({format_percent(fit.nrmse.train)}).",
        )
    ]


def _describe_convergence(fit: Fit) -> list[Finding]:
    if fit.result == "converged":
        return []
    severity: Literal["plain", "warning"] = "plain" if fit.result.startswith("converged") else "warning"
    return [Finding(severity, f"Result of the fit: {fit.result}.")]


def _describe_drives(log: Log, fit: Fit) -> list[Finding]:
    """Warn if the drive of the recording exceeds the fitted range."""
    low, high = fit.drive_range
    drive, span = log.samples["coil_drive"], high - low
    margin = max(_EXTRAPOLATION_SHARE * span, 1e-3)
    first, last = float(drive.min()), float(drive.max())
    if first >= low - margin and last <= high + margin:
        return []
    unit, recorded_span = fit.drive_unit, last - first
    return [
        Finding(
            "warning",
            f"The drive of the recording is {format_drive(first, recorded_span)} to "
            f"{format_drive(last, recorded_span)} {unit}, the fitted range is {format_drive(low, span)} to "
            f"{format_drive(high, span)} {unit}. Beyond this range the fit extrapolates.",
        )
    ]


def _describe_identifiability(fit: Fit) -> list[Finding]:
    """Describe which parameters the strokes determine."""
    free = {name: e for name, e in fit.parameters.items() if not is_gauge(name, e)}
    unknown = [name for name, e in free.items() if not e.identifiable]
    text = f"The strokes determine {len(free) - len(unknown)} of the {len(free)} parameters that affect the force"
    gauge = (
        " The fourteenth parameter, A, is a gauge: it rescales four others without changing any force, so that no "
        "recording determines it."
        if len(free) < len(fit.parameters)
        else ""
    )
    if unknown:
        return [Finding("warning", f"{text}. Not determined: {', '.join(unknown)}.{gauge}")]
    return [Finding("good", f"{text}.{gauge}")]


def is_gauge(name: str, estimate: Estimate) -> bool:
    """Return whether a parameter is the gauge, on which no force depends."""
    return name == "A" and not estimate.identifiable


def _describe_delays(fit: Fit) -> list[Finding]:
    delays = {"force": fit.nuisances.force_delay, "drive": fit.nuisances.drive_delay}
    return [
        Finding(
            "plain", f"The delay of the {name} channel, {_format_delay(delay)}, exceeds what clock errors explain."
        )
        for name, delay in delays.items()
        if delay.outside_prior
    ]


def _format_delay(delay: DelayEstimate) -> str:
    return str(format_quantity(delay.value, delay.ci95, "s"))


def _describe_calibration() -> Finding:
    return Finding(
        "plain",
        "Gain errors of the force and displacement channels cannot be distinguished from parameters of the damper:"
        " the parameters rely on the calibration.",
    )
