"""Noise with the smooth spectrum of a residual: what a test finds in it, it finds by chance."""

import math

import numpy as np

from identification.arrays import Array
from identification.gap.data import Residual

_BANDS = 4
"""Bands of an octave in which the spectrum is smooth."""
_FEWEST_LINES = 8
"""Smallest number of lines of which the power of a slow line is a mean; a fit may have removed some of them."""


def simulate_noise(residual: Residual, draws: int, highest: float = math.inf) -> Array:
    """Return noise (N, draws) [N] of the smooth spectrum of a residual up to a frequency [Hz].

    The mean power of narrow bands is kept, and phases are random (surrogate data, Theiler et al. 1992). The noise
    is stationary, whatever the residual is.
    """
    random = np.random.default_rng(2)
    noise = np.zeros((len(residual.values), draws))
    for part, rate in residual.parts:
        values = np.where(residual.valid[part], residual.values[part], 0.0)
        power = _compute_smooth_power(values)
        slow = np.fft.rfftfreq(len(values), 1.0 / rate) < highest
        normal = random.standard_normal((2, draws, len(power)))
        spectrum = np.sqrt(0.5 * power * slow) * (normal[0] + 1j * normal[1])
        noise[part] = np.fft.irfft(spectrum, len(values)).T
    return noise


def compute_noise_evidence(residual: Residual, change: Array) -> float:
    """Return the log likelihood ratio (natural) of a change of the residual over its absence, in this noise.

    It is half the squared ratio of the change to its standard deviation, if stationary noise is regressed on it.

    Args:
        residual: residual that is noise.
        change: (N,) change by an effect, which the residual no longer contains [N].
    """
    # The law fits the mean, so that neither of them contains it.
    centred = np.where(residual.valid, change - change[residual.valid].mean(), 0.0)
    variance = 0.0
    for part, _ in residual.parts:
        valid = residual.valid[part]
        power = _compute_expected_power(np.where(valid, residual.values[part], 0.0))
        transform = np.abs(np.fft.rfft(centred[part])) ** 2
        # Each line but the first stands for a positive and a negative frequency.
        sides = np.where(np.arange(len(power)) == 0, 1.0, 2.0)
        variance += float(sides @ (power * transform)) / len(valid) ** 2
    return 0.5 * float(centred @ centred) ** 2 / variance if variance else math.inf


def _compute_smooth_power(values: Array) -> Array:
    """Return the power (K,) of the transform of values (N,) at each frequency, the mean of a narrow band."""
    power = np.abs(np.fft.rfft(values)) ** 2
    band = np.floor(_BANDS * np.log2(np.maximum(np.arange(len(power)), 0.5))).astype(int) + _BANDS
    level = np.bincount(band, power) / np.maximum(np.bincount(band), 1)
    return np.asarray(level[band])


def _compute_expected_power(values: Array) -> Array:
    """Return the expected power (K,) of the transform of noise (N,) at each frequency.

    The product of line number and power is averaged over an octave on each side. It is constant in 1/f noise. In
    white noise, the mean is a quarter too high.
    """
    line = np.arange(len(values) // 2 + 1)
    total = np.cumsum(line * np.abs(np.fft.rfft(values)) ** 2)
    last = np.minimum(np.maximum(2 * line, _FEWEST_LINES), line[-1])
    before = np.maximum((line + 1) // 2 - 1, 0)
    return np.asarray((total[last] - total[before]) / ((last - before) * np.maximum(line, 1)))
