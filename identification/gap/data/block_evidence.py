"""Block evidence: logarithm of the odds between two candidates, summed over short blocks (decision 0016).

The correct effect in another form than the damper's leaves a form error, which is large in some blocks and small
in others. In the total sum of squares, the large blocks mask the contribution of a second effect in all others.
Each block therefore has an unknown error size of its own, and its likelihood is that of a normal error of unknown
size. An active effect reduces the error wherever it acts. An effect that only absorbs the form error of another
reduces it in one block and increases it in the next.
"""

import numpy as np

from identification.gap.data.block_squares import compute_block_squares
from identification.gap.data.correlation import compute_correlation_length
from identification.gap.data.residual_map import Residual

_EFFECTIVE_SAMPLES = 1.6
"""Independent samples in a block. Origin: chosen between the evidence of true effects and of confusable ones."""


def compute_evidence(
    before: Residual, after: Residual, block_length: float, samples: float = _EFFECTIVE_SAMPLES
) -> float:
    """Return the log odds (natural) of the candidate that leaves ``after`` over the one that leaves ``before``.

    A block lasts ``block_length`` [s]: less than a stroke, more than the field takes to settle. It counts as
    ``samples`` independent samples.
    """
    ratios = compute_block_squares(before, block_length) / compute_block_squares(after, block_length)
    return 0.5 * samples * float(np.sum(np.log(ratios)))


def count_independent_samples(residual: Residual, block_length: float) -> float:
    """Return the number of independent samples in a block of a residual: its length over the correlation time.

    Use it where the residual is the error of a model, not noise. It is never below the number that holds between
    confusable effects.
    """
    times, weights = [], []
    for part, rate in residual.parts:
        values = np.where(residual.valid[part], residual.values[part], 0.0)
        if values.any():
            times.append(compute_correlation_length(values) / rate)
            weights.append(float(values @ values))
    return max(block_length / float(np.average(times, weights=weights)), _EFFECTIVE_SAMPLES)


def bound_evidence(residual: Residual, floor: float, block_length: float) -> float:
    """Compute the evidence for a candidate whose error would be the floor [N] in every block above it."""
    ratios = np.maximum(compute_block_squares(residual, block_length) / floor**2, 1.0)
    return 0.5 * _EFFECTIVE_SAMPLES * float(np.sum(np.log(ratios)))
