"""Smooth spectrum of the noise of one stretch, from all of its repeated windows.

It completes the spectrum of a window where the window's fit removes the noise. At frequencies that another window
shows, it is the mean power of a band. Below them it is extrapolated, as white noise with a slow part: 1/f noise,
or a relaxation. The correlation of a relaxation decays exponentially, and its power is constant below a corner
frequency. The lowest bands give each of these a probability, and the extrapolation is their mean.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from identification.arrays import Array

_BANDS = 4
"""Bands of an octave."""
_LOWEST_BANDS = 12
"""Number of the lowest bands, three octaves, that determine the extrapolation."""
_CORNERS = 2.0 ** np.arange(-3, 5)
"""Corner frequencies of relaxations, over the lowest observed frequency [1]."""
_ITERATIONS = 30
"""Steps of a maximum-likelihood fit."""


class Continuation(NamedTuple):
    """White noise with one slow part, fitted to the lowest bands."""

    corner: float
    """Corner frequency of the slow part [Hz]; 0 for 1/f noise."""
    unit: float
    """Frequency at which 1/f noise of unit size has the power 1 [Hz]."""
    powers: Array
    """(2,) power of the white part and of the slow part [N²]."""
    covariance: Array
    """(2, 2) their covariance [N⁴]."""
    log_likelihood: float

    @classmethod
    def fit(cls, corner: float, frequency: Array, level: Array, freedom: Array) -> "Continuation":
        """Fit the mean powers of bands by maximum likelihood (Whittle 1953).

        Args:
            corner: corner frequency of the slow part [Hz]; 0 for 1/f noise.
            frequency: (B,) frequencies of the bands [Hz].
            level: (B,) their mean powers [N²], positive.
            freedom: (B,) number of bins in each [1].
        """
        empty = cls(corner, float(frequency[0]), np.zeros(2), np.zeros((2, 2)), 0.0)
        columns, expected = empty.make_columns(frequency), level
        for _ in range(_ITERATIONS):
            # A power is exponentially distributed: its standard deviation is its expectation.
            root = np.sqrt(freedom) / np.maximum(expected, 1e-6 * level.max())
            powers = nnls(columns * root[:, None], level * root)[0]
            expected = columns @ powers
        weighted = columns * root[:, None]
        # No part is negative, so none exceeds the largest power: that is its prior standard deviation.
        covariance = np.linalg.inv(weighted.T @ weighted + np.eye(2) / level.max() ** 2)
        likelihood = -float(freedom @ (np.log(expected) + level / expected))
        return empty._replace(powers=powers, covariance=covariance, log_likelihood=likelihood)

    def make_columns(self, frequency: Array) -> Array:
        """Return the powers (B, 2) of parts of unit size at frequencies (B,) [Hz]."""
        slow = 1.0 / (1.0 + (frequency / self.corner) ** 2) if self.corner else self.unit / frequency
        return np.column_stack([np.ones(len(frequency)), slow])

    def integrate(self, start: float, stop: float) -> Array:
        """Return the integrals (2,) [Hz] of parts of unit size from one frequency to another [Hz]."""
        if self.corner:
            slow = self.corner * float(np.arctan(stop / self.corner) - np.arctan(start / self.corner))
        else:
            slow = self.unit * float(np.log(stop / start))
        return np.array([stop - start, slow])


class SmoothSpectrum(NamedTuple):
    """Power of the noise of a stretch, with its uncertainty."""

    frequency: Array
    """(B,) frequencies of the observed bands [Hz], rising."""
    level: Array
    """(B,) their mean powers [N²]."""
    freedom: Array
    """(B,) number of bins in each, as far as they show the noise [1]."""
    continuations: Sequence[Continuation]
    """Possible spectra below the bands; none if there is no noise."""
    probabilities: Array
    """Their probabilities [1]."""


def fit_smooth_spectrum(frequency: Array, power: Array, gain: Array) -> SmoothSpectrum:
    """Fit the spectrum of noise to the bins of all windows of a stretch.

    Args:
        frequency: (N,) frequencies at which the noise was observed [Hz], positive, at least one, in any order.
        power: (N,) observed powers [N²].
        gain: (N,) part of the power of the noise that each shows [1], positive.
    """
    lowest = float(frequency.min())
    band = np.asarray(np.floor(_BANDS * np.log2(frequency / lowest)), np.intp)
    sums = np.stack([np.bincount(band, values) for values in (gain, power, gain * frequency)])
    freedom, level, centre = sums[:, sums[0] > 0.0]
    level, centre = level / freedom, centre / freedom
    if level.max() < 1e-300:
        return SmoothSpectrum(centre, np.zeros(len(level)), freedom, (), np.zeros(0))
    low = slice(_LOWEST_BANDS)
    corners = [0.0, *(lowest * _CORNERS)]
    fits = tuple(Continuation.fit(corner, centre[low], level[low], freedom[low]) for corner in corners)
    likelihoods = np.array([fit.log_likelihood for fit in fits])
    # 1/f noise and relaxations have the same prior probability, and so have the corners of relaxations.
    weights = np.exp(likelihoods - likelihoods.max()) * [1.0, *np.full(len(_CORNERS), 1.0 / len(_CORNERS))]
    return SmoothSpectrum(centre, level, freedom, fits, weights / weights.sum())


class MissingPart:
    """The lowest bins of a window, in which its fit removes the noise."""

    def __init__(self, smooth: SmoothSpectrum, frequency: Array, samples: int, duration: float) -> None:
        """Take the power of the bins from the smooth spectrum.

        Args:
            smooth: spectrum of the noise of the stretch.
            frequency: (M,) frequencies of the bins from 0 on, with the next one at the end [Hz].
            samples: number of samples of the window.
            duration: duration of the whole recording [s], whose mean is not noise.
        """
        self._smooth, self._samples, step = smooth, samples, float(frequency[1])
        bins = frequency[:-1]
        below = max(int(np.count_nonzero(bins < smooth.frequency[0])), 1)
        # A bin stands for half a step on both sides; the first one begins at one cycle a recording.
        first = min(1.0 / duration, 0.25 * step), 0.5 * step
        self._columns = [
            np.vstack([c.integrate(*first) / step, c.make_columns(bins[1:below])]) for c in smooth.continuations
        ]
        parts = [columns @ c.powers for columns, c in zip(self._columns, smooth.continuations, strict=True)]
        self._band = np.searchsorted(np.sqrt(smooth.frequency[1:] * smooth.frequency[:-1]), bins[below:])
        extrapolated = smooth.probabilities @ np.array(parts) if parts else np.zeros(below)
        self.power: Array = np.concatenate([extrapolated, smooth.level[self._band]])
        """(M - 1,) power of the bins [N²]."""

    def compute_deviation(self, gain: Array) -> float:
        """Return the standard deviation [N²] of the variance of these bins, seen with gains (M - 1,) [1]."""
        below, smooth = len(self.power) - len(self._band), self._smooth
        seen = np.bincount(self._band, gain[below:], len(smooth.level))
        square = float(np.sum((seen * smooth.level) ** 2 / smooth.freedom))
        if smooth.continuations:
            weights = np.array([gain[:below] @ columns for columns in self._columns])
            sums = np.array([w @ c.powers for w, c in zip(weights, smooth.continuations, strict=True)])
            squares = [w @ c.covariance @ w for w, c in zip(weights, smooth.continuations, strict=True)]
            mean = smooth.probabilities @ sums
            square += float(smooth.probabilities @ (squares + (sums - mean) ** 2))
        return 2.0 * float(np.sqrt(square)) / self._samples
