"""Mean square of a residual in short blocks."""

import math

import numpy as np

from identification.arrays import Array
from identification.gap.data.residual_map import Residual

_MIN_VALID_SHARE = 0.5
"""Share of valid samples above which a block counts."""


def compute_block_squares(residual: Residual, block_length: float) -> Array:
    """Return the mean squared residual (blocks,) [N²] of each block of a length [s]."""
    means = []
    for part, rate in residual.parts:
        size = max(math.ceil(block_length * rate), 1)
        whole = slice(part.start, part.start + (part.stop - part.start) // size * size)
        valid = residual.valid[whole].reshape(-1, size)
        sums = np.sum(np.where(valid, residual.values[whole].reshape(-1, size) ** 2, 0.0), axis=1)
        counts = valid.sum(axis=1)
        used = counts > _MIN_VALID_SHARE * size
        means.append(sums[used] / counts[used])
    return np.concatenate(means)
