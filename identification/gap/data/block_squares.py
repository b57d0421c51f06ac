"""Mean square of a residual in short blocks."""

import math

import numpy as np

from identification.arrays import Array
from identification.gap.data.residual_map import Residual

_MIN_VALID_SHARE = 0.5
"""Share of valid samples above which a block counts."""


def compute_block_squares(residual: Residual, block_length: float) -> Array:
    """Return the mean squared residual (blocks,) [N²] of each block of a length [s]."""
    means, start = [], 0
    for count, rate in residual.rates:
        size = max(math.ceil(block_length * rate), 1)
        part = slice(start, start + count // size * size)
        valid = residual.valid[part].reshape(-1, size)
        sums = np.sum(np.where(valid, residual.values[part].reshape(-1, size) ** 2, 0.0), axis=1)
        counts = valid.sum(axis=1)
        used = counts > _MIN_VALID_SHARE * size
        means.append(sums[used] / counts[used])
        start += count
    return np.concatenate(means)
