"""Recordings drawn at random: noise of several spectra, resolution, and the stretch around them."""

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from identification.arrays import Array
from identification.logs import Segment, Stretch

RELATIVE_NOISE = 0.01
"""Noise of the force over its standard deviation [1]."""
CORRELATION_TIME = 0.02
"""Correlation time of slow noise [s]."""


def make_slow_noise(count: int, rate: float, random: np.random.Generator) -> Array:
    """Return noise (N,) of variance 1 whose correlation decays within the correlation time."""
    decay = np.exp(-1.0 / (rate * CORRELATION_TIME))
    burn_in = round(20.0 * CORRELATION_TIME * rate) + 10
    white = random.standard_normal(count + burn_in) * np.sqrt(1.0 - decay**2)
    return np.asarray(lfilter([1.0], [1.0, -decay], white)[burn_in:])


def make_pink_noise(count: int, rate: float, random: np.random.Generator) -> Array:
    """Return noise (N,) of variance 1 whose power falls with the frequency."""
    bins = np.arange(1, count + 1)
    spectrum = np.concatenate(
        [[0.0], (random.standard_normal(count) + 1j * random.standard_normal(count)) / np.sqrt(bins)]
    )
    noise = np.fft.irfft(spectrum, 2 * count)[:count]
    return np.asarray(noise / noise.std())


def make_white_noise(count: int, rate: float, random: np.random.Generator) -> Array:
    """Return white noise (N,) of variance 1."""
    return random.standard_normal(count)


Source = Callable[[int, float, np.random.Generator], Array]
SPECTRA: dict[str, tuple[tuple[float, Source], ...]] = {
    "white": ((1.0, make_white_noise),),
    "half slow (20 ms)": ((0.5, make_white_noise), (0.5, make_slow_noise)),
    "nine tenths slow": ((0.1, make_white_noise), (0.9, make_slow_noise)),
    "1/f": ((1.0, make_pink_noise),),
    "half 1/f": ((0.5, make_white_noise), (0.5, make_pink_noise)),
}
"""Shares of the variance and their sources, by name."""


def draw_noise(spectrum: str, count: int, rate: float, random: np.random.Generator) -> Array:
    """Return noise (N,) of variance 1 of a spectrum in `SPECTRA`, at a rate [Hz]."""
    parts = [np.sqrt(share) * make(count, rate, random) for share, make in SPECTRA[spectrum]]
    return np.asarray(np.sum(parts, axis=0))


def round_to(values: Array, digit: float) -> Array:
    """Return values with a resolution."""
    return np.asarray(np.round(values / digit) * digit)


def make_stretch(
    rate: float, displacement: Array, force: Array, drive: Array, segments: tuple[Segment, ...]
) -> Stretch:
    """Return a stretch of which every sample was measured: rate [Hz], displacement [m], force [N], drive."""
    count = len(displacement)
    return Stretch(
        "drawn", np.arange(count) / rate, rate, displacement, force, drive, None, segments, None, None, 0.0, 0.0,
        0.0, np.ones(count, bool),
    )  # fmt: skip
