"""Definitions of the terms and algorithms of a report."""

from bench.report.formats.derived import QUANTITIES

ALGORITHMS: tuple[tuple[str, str, str], ...] = (
    (
        "velocity_smoothed_mps",
        "m/s",
        "Derivative of a local polynomial through the displacement; a column velocity_mps is measured.",
    ),
    (
        "noise floor",
        "N",
        "Standard deviation of the noise in the recorded force: from the differences of repeated cycles, "
        "or from frequencies above those of a damper where no cycle repeats.",
    ),
    ("RMSE", "N", "Root mean square of simulated minus recorded force over the samples in question."),
    ("NRMSE", "1", "RMSE over the standard deviation of the recorded force in the same samples."),
    (
        "fit",
        "",
        "Modified Bouc-Wen model of Spencer et al. (1997), fitted to the force by weighted least squares.",
    ),
    (
        "95 % interval",
        "",
        "From the covariance of the weighted least squares, with the noise of the displacement included.",
    ),
    ("identifiable", "", "Whether these strokes determine the parameter, whatever its value is."),
    ("gap", "N", "Force error of the refitted law beyond the noise floor, on strokes that no fit has read."),
    (
        "closed part of the gap",
        "1",
        "1 - (error with the effects² - floor²) / (error of the law² - floor²), on strokes that no fit has read.",
    ),
    (
        "probability of an effect",
        "1",
        "Probability that the effect is active, over all sets of effects compared.",
    ),
)
"""Term, unit and definition."""


def list_definitions() -> list[tuple[str, str, str]]:
    """Return term, unit and definition of derived values and algorithms."""
    derived = [(one.title, one.unit, one.definition) for one in QUANTITIES.values()]
    return [*derived, *ALGORITHMS]
