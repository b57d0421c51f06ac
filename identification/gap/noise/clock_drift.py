"""Clock drift: residual that slow changes of the force channel's delay cause (decision 0017).

Between two devices on wires, the delay changes by some hundredths of a millisecond over seconds. A fit has one
constant delay, so even the correct law leaves a few per cent above the noise floor. If a delay that may drift
as far as the log allows explains all of the gap, no effect is searched for. An effect of a damper remains.
"""

from dataclasses import replace

import numpy as np

from identification.fitting import Problem
from identification.gap.data import EvaluationData
from identification.gap.fits import Candidate
from identification.uncertainty import compute_drift_correction


def subtract_clock_drift(
    candidate: Candidate, full_problem: Problem, evaluation: EvaluationData, clock_deviation: float
) -> tuple[Candidate, float]:
    """Remove clock drift from a candidate's residual, on fitted and held-out samples.

    ``clock_deviation`` is the standard deviation of the delay between the channels [s].

    Returns:
        The corrected candidate, and the root mean square drift of the delay [s].
    """
    problem = replace(full_problem.replace_effects(candidate.fit.effects), pieces=evaluation.pieces)
    corrections, drift = compute_drift_correction(problem, candidate.fit.minimum.unknowns, clock_deviation)
    # Residuals of a problem are simulated less recorded force, relative to the noise.
    values = candidate.residual.values - problem.noise * np.concatenate(corrections)
    residual = replace(candidate.residual, values=values)
    train, held_out = evaluation.compute_rmse(residual)
    return replace(candidate, residual=residual, train_rmse=train, held_out_rmse=held_out), drift


def describe_drift_explanation(drift: float) -> str:
    """Return the note for a clock drift [s] that explains all of the gap."""
    return (
        f"the delay of the force channel drifts by {1e6 * drift:.2g} µs within the run, which is within the clock "
        "deviation in its log; after this drift is removed, no gap remains above the noise floor"
    )
