"""Noise for tests."""

import numpy as np

from identification.arrays import Array


def make_pink_noise(count: int, random: np.random.Generator) -> Array:
    """Return 1/f noise (N,) of variance 1."""
    lines = random.standard_normal(count) + 1j * random.standard_normal(count)
    spectrum = np.concatenate([[0.0], lines / np.sqrt(np.arange(1, count + 1))])
    noise = np.fft.irfft(spectrum, 2 * count)[:count]
    return np.asarray(noise / noise.std())
