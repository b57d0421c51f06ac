"""What a report says first, in plain words: what was reached, what falls short, what cannot be known."""

from typing import Literal, NamedTuple

from bench.recorder.reader import Log
from bench.report.documents import Delay, Estimate, Fit, Prediction
from bench.report.values import level, newton, percent, quantity, significant

_AS_GOOD, _NEAR = 1.05, 1.2
"""[1] force error over the noise floor up to which nothing, or only little, is left to explain."""
_BEYOND = 0.02
"""[1] share of the fitted drives' span by which a recording may leave it unmentioned."""


class Finding(NamedTuple):
    """One sentence or two, and what it means."""

    mood: Literal["good", "plain", "warning"]
    text: str


def findings(log: Log, fit: Fit | None, prediction: Prediction | None, seen: bool) -> list[Finding]:
    """Everything that a reader should know first.

    Args:
        log: the recording.
        fit: the damper, or none for a report of the recording alone.
        prediction: the fit simulated on this recording.
        seen: whether the fit was made from this recording.
    """
    found = [_outcome(log)]
    if fit is None or prediction is None:
        return [*found, Finding("plain", "No fit was given: this page shows the recording alone.")]
    found += [*_origin(log, fit, seen), _error(prediction)]
    found += _held_out(fit, seen) + _convergence(fit) + _drives(log, fit)
    return [*found, *_known(fit), *_delays(fit), _calibration()]


def _outcome(log: Log) -> Finding:
    """How the recording ended."""
    outcome = log.metadata.get("outcome", {})
    ended, reason = outcome.get("outcome", "unknown"), outcome.get("reason", "")
    if ended == "clean":
        return Finding("good", "The recording is clean: no sample was lost.")
    meaning = {
        "lossy": "samples were lost on the way",
        "truncated": "its end is missing",
        "incomplete": "the run was ended before the method was through",
    }.get(ended, "how it ended is not known")
    return Finding("warning", f"The recording is {ended}: {meaning}{f' ({reason})' if reason else ''}.")


def _origin(log: Log, fit: Fit, seen: bool) -> list[Finding]:
    """What the fit was made from, where it was not this log alone."""
    names = ", ".join(fit.provenance.logs)
    specimen = log.metadata["run"].get("specimen", "")
    found = []
    if not seen:
        found.append(
            Finding(
                "plain",
                f"The fit was made from another recording ({names}). Everything simulated here is a prediction "
                "on strokes that the fit never saw.",
            )
        )
    elif len(fit.provenance.logs) > 1:
        found.append(Finding("plain", f"The fit was made from {len(fit.provenance.logs)} recordings: {names}."))
    if fit.specimen and specimen and fit.specimen != specimen:
        found.append(
            Finding("warning", f"The fit is of specimen “{fit.specimen}”, this recording of “{specimen}”.")
        )
    return found


def _error(prediction: Prediction) -> Finding:
    """The force error beside the noise floor."""
    ratio = prediction.rmse_n / prediction.noise_floor_n if prediction.noise_floor_n > 0 else float("inf")
    text = (
        f"The law repeats the recorded force to {newton(prediction.rmse_n)} (RMSE, "
        f"{percent(prediction.nrmse)} of the force's standard deviation); "
        f"the noise floor of the recording is {newton(prediction.noise_floor_n)}."
    )
    if ratio <= _AS_GOOD:
        return Finding("good", f"{text} No model could come noticeably closer on this recording.")
    if ratio <= _NEAR:
        return Finding("plain", f"{text} It stays {100 * (ratio - 1):.0f} % above the floor: a little is left.")
    return Finding(
        "warning",
        f"{text} That is {significant(ratio, 2)} times the floor: the damper, or the bench, does something that "
        "this law and its values do not have. This report does not say what.",
    )


def _held_out(fit: Fit, seen: bool) -> list[Finding]:
    if not seen or fit.rmse_n.held_out is None or fit.nrmse.held_out is None:
        return []
    return [
        Finding(
            "plain",
            f"On the strokes held out of the fit the error is {newton(fit.rmse_n.held_out)} "
            f"({percent(fit.nrmse.held_out)}), on those fitted {newton(fit.rmse_n.train)} "
            f"({percent(fit.nrmse.train)}).",
        )
    ]


def _convergence(fit: Fit) -> list[Finding]:
    if fit.result == "converged":
        return []
    mood: Literal["plain", "warning"] = "plain" if fit.result.startswith("converged") else "warning"
    return [Finding(mood, f"The fit says of itself: {fit.result}.")]


def _drives(log: Log, fit: Fit) -> list[Finding]:
    """Whether the recording leaves the drives that were fitted."""
    low, high = fit.drive_range
    drive, span = log.samples["coil_drive"], high - low
    margin = max(_BEYOND * span, 1e-3)
    first, last = float(drive.min()), float(drive.max())
    if first >= low - margin and last <= high + margin:
        return []
    unit = fit.drive_unit
    return [
        Finding(
            "warning",
            f"The recording's drive goes from {level(first, last - first)} to {level(last, last - first)} {unit}, "
            f"the fit knows {level(low, span)} to {level(high, span)} {unit}: beyond that it extrapolates.",
        )
    ]


def _known(fit: Fit) -> list[Finding]:
    """Which parameters the strokes fix, and which not."""
    free = {name: e for name, e in fit.parameters.items() if not is_gauge(name, e)}
    unknown = [name for name, e in free.items() if not e.identifiable]
    text = (
        f"{len(free) - len(unknown)} of the {len(free)} parameters that a force can show are fixed by the strokes"
    )
    gauge = (
        " The fourteenth, A, is a gauge: it rescales four others without changing any force, and no recording "
        "reveals it."
        if len(free) < len(fit.parameters)
        else ""
    )
    if unknown:
        return [Finding("warning", f"{text}; these are not: {', '.join(unknown)}.{gauge}")]
    return [Finding("good", f"{text}.{gauge}")]


def is_gauge(name: str, estimate: Estimate) -> bool:
    """Whether a parameter is the one that no force reveals."""
    return name == "A" and not estimate.identifiable


def _delays(fit: Fit) -> list[Finding]:
    named = {"force": fit.nuisances.force_delay, "drive": fit.nuisances.drive_delay}
    return [
        Finding("plain", f"The {name} channel's lag of {_lag(delay)} is more than the clocks explain.")
        for name, delay in named.items()
        if delay.outside_prior
    ]


def _lag(delay: Delay) -> str:
    return str(quantity(delay.value, delay.ci95, "s"))


def _calibration() -> Finding:
    return Finding(
        "plain",
        "Gains of the force and displacement channels cannot be told from the damper's own values: "
        "they rest on the calibration.",
    )
