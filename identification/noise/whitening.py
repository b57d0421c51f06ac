"""Filter that makes coloured noise white.

Errors of a model are then compared with the noise at their own frequencies. Slow noise would otherwise hide an
error that is certain. The spectrum follows from the variances by time scale. The filter is causal and of minimum
phase, from the cepstrum (Oppenheim and Schafer, Discrete-Time Signal Processing, chapter 13).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.noise.time_scales import ScaleVariance, compute_gain

_GRID = 8192
"""Number of frequencies at which the spectrum is evaluated."""
_TAPS_PER_SCALE = 8
"""Length of the filter over the longest scale [1]."""
_CORRECTIONS = 8
"""Corrections of the power at the frequencies between which the spectrum is interpolated."""
_LARGEST_CORRECTION = 2.0
"""Largest factor of all corrections, either way [1]; a variance that is small by chance would demand more.

Origin: 0.45 to 1.9 on 100 series of five spectra, 8 and 60 seconds long at 1 kHz.
"""
_DEVIATIONS = 2.0
"""Standard deviations by which the spectrum differs from that of white noise where it is taken for coloured."""


class WhiteningFilter(NamedTuple):
    """Filter of a force; the first of its taps is 1."""

    taps: Array
    """(T,) [1]"""
    deviation: float
    """Standard deviation of the noise behind the filter [N]."""

    def apply(self, values: Array) -> Array:
        """Return the filtered values (N,)."""
        length = 1 << (len(values) + len(self.taps) - 1).bit_length()
        product = np.fft.rfft(values, length) * np.fft.rfft(self.taps, length)
        return np.asarray(np.fft.irfft(product, length)[: len(values)])


def design_whitening_filter(scales: Sequence[ScaleVariance], white: float) -> WhiteningFilter:
    """Return the filter for noise with some variances by time scale.

    Args:
        scales: variances of the noise; without any, the noise is white.
        white: standard deviation of its white part [N], from high frequencies.
    """
    samples, variance, deviation = (np.array([s[k] for s in scales], float) for k in range(3))
    white_variance = white**2 / (2.0 * samples)
    is_coloured = np.abs(variance - white_variance) > _DEVIATIONS * deviation
    if not is_coloured.any() or variance.min() <= 0.0 or white == 0.0:
        return WhiteningFilter(np.ones(1), white)
    # Where the slowest scales are too uncertain to tell, the spectrum goes on as at the last certain one.
    known = slice(np.flatnonzero(is_coloured)[-1] + 1)
    level = _fit_spectrum(samples[known], np.where(is_coloured, variance, white_variance)[known])
    cepstrum = np.fft.irfft(-0.5 * np.log(level))
    folded = np.concatenate([cepstrum[:1], 2.0 * cepstrum[1 : _GRID // 2], cepstrum[_GRID // 2 : _GRID // 2 + 1]])
    taps = np.fft.irfft(np.exp(np.fft.rfft(folded, _GRID)))
    count = min(_TAPS_PER_SCALE * int(samples[is_coloured][-1]), _GRID // 2)
    return WhiteningFilter(taps[:count] / taps[0], 1.0 / float(taps[0]))


def _fit_spectrum(samples: Array, variance: Array) -> Array:
    """Return the power (_GRID // 2 + 1,) [N²] of noise with variances (S,) [N²] at scales (S,) [samples].

    It is interpolated between one frequency for each scale. A scale also contains a part of its neighbours'
    frequencies, so the power at all of them is corrected until the variances are right.
    """
    grid = np.asarray(np.fft.rfftfreq(_GRID)[1:], float)
    gains = np.array([compute_gain(grid, int(m)) for m in samples])
    # Half of the variance at a scale of m samples is above and half below this frequency, if the noise is white.
    middle = np.log(1.0 / (2.0**1.5 * samples))
    first = power = 2.0 * samples * variance
    for _ in range(_CORRECTIONS):
        level = np.exp(np.interp(np.log(grid), middle[::-1], np.log(power)[::-1]))
        corrected = power * variance / (gains @ level / len(grid))
        power = np.clip(corrected, first / _LARGEST_CORRECTION, first * _LARGEST_CORRECTION)
    return np.concatenate([level[:1], level])
