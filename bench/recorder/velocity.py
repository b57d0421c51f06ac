"""Velocity for viewers, from displacement alone.

A parabola is fitted to each 20 ms of displacement (Savitzky-Golay) and its slope at the middle is the
velocity: no phase lag, noise down by an order of magnitude. It is for the eye; an identification makes its own
derivatives from the displacement.
"""

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

WINDOW = 0.020
"""[s] of displacement behind each velocity; five samples where the rate is too low for that."""


def smooth_velocity(displacement: npt.NDArray[np.float64], rate: float) -> npt.NDArray[np.float64]:
    """Velocity of a smoothed displacement.

    Args:
        displacement: [m], shape (samples,), uniformly sampled.
        rate: [Hz].

    Returns:
        [m/s], shape (samples,).
    """
    samples = len(displacement)
    if samples < 2:
        return np.zeros(samples)
    half = max(2, round(WINDOW * rate / 2))
    window = min(2 * half + 1, samples - 1 + samples % 2)
    order = min(2, window - 1)
    if order < 1:
        return np.gradient(displacement, 1 / rate)
    return np.asarray(savgol_filter(displacement, window, order, deriv=1, delta=1 / rate), dtype=np.float64)
