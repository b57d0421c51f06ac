"""White noise of a force from fourth differences, which contain only frequencies too high for a damper."""

import math

import numpy as np

from identification.arrays import Array
from identification.signals import estimate_white_noise


def estimate_high_frequency_noise(force: Array) -> float:
    """Return the standard deviation [N] of the white noise in a force (N,), by the median of fourth differences.

    The channel's own filter does not shape this noise, which is added where the force is digitised. The force is
    dithered by half a digit first, because the median of a few coarse steps is inexact.
    """
    levels = np.unique(np.abs(np.diff(force)))
    digit = float(np.min(levels[levels > 1e-9 * np.ptp(force)], initial=np.ptp(force)))
    dither = digit * (np.random.default_rng(0).random(len(force)) - 0.5)
    noise = estimate_white_noise(force + dither, 4)
    return math.sqrt(max(noise**2 - digit**2 / 12.0, 0.0)) if digit < noise * 10.0 else noise
