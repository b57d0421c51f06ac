"""Simulated noise with the spectrum of a residual: what a test finds in it, it finds by chance."""

import math

import numpy as np

from identification.arrays import Array
from identification.gap.data import Residual

_BANDS = 4
"""Bands of an octave in which the spectrum is smooth."""


def simulate_noise(residual: Residual, draws: int, highest: float = math.inf) -> Array:
    """Return noise (N, draws) [N] of the smooth spectrum of a residual up to a frequency [Hz].

    The mean power of narrow bands is kept, and phases are random (surrogate data, Theiler et al. 1992). The noise
    is stationary, whatever the residual is.
    """
    random = np.random.default_rng(2)
    noise = np.zeros((len(residual.values), draws))
    for part, rate in residual.parts:
        values = np.where(residual.valid[part], residual.values[part], 0.0)
        power = np.abs(np.fft.rfft(values)) ** 2
        band = np.floor(_BANDS * np.log2(np.maximum(np.arange(len(power)), 0.5))).astype(int) + _BANDS
        level = np.bincount(band, power) / np.maximum(np.bincount(band), 1)
        slow = np.fft.rfftfreq(len(values), 1.0 / rate) < highest
        normal = random.standard_normal((2, draws, len(power)))
        spectrum = np.sqrt(0.5 * level[band] * slow) * (normal[0] + 1j * normal[1])
        noise[part] = np.fft.irfft(spectrum, len(values)).T
    return noise
