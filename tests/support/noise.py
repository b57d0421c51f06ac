"""Noise for tests."""

import numpy as np

from identification.arrays import Array
from identification.gap.data import Residual


def make_pink_noise(count: int, random: np.random.Generator) -> Array:
    """Return 1/f noise (N,) of variance 1."""
    lines = random.standard_normal(count) + 1j * random.standard_normal(count)
    spectrum = np.concatenate([[0.0], lines / np.sqrt(np.arange(1, count + 1))])
    noise = np.fft.irfft(spectrum, 2 * count)[:count]
    return np.asarray(noise / noise.std())


def make_residual(values: Array, rate: float = 100.0) -> Residual:
    """Return noise (N,) [N] as the residual of one stretch, every sample valid."""
    zeros = np.zeros(len(values))
    time = np.arange(len(values)) / rate
    return Residual(values, zeros, zeros, time, np.ones(len(values), bool), ((len(values), rate),))
