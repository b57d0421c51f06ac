"""Variance of a signal by time scale: of half the difference of two neighbouring means (Haar wavelet).

A difference of two means of m samples hardly contains changes that are much slower or faster than 2 m samples. It
shows an error of a model at this scale even if much stronger slow noise hides it in the total. The variances at
m = 1, 2, 4, ... samples add up to that of the signal (Percival 1995, Biometrika 82:619).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from identification.arrays import Array, BoolArray

_FEWEST_DIFFERENCES = 8
"""Smallest number of separate differences in a signal for a variance at a scale."""
_SLOW_SCALES = 4
"""Number of the longest scales that determine slow noise: about a decade of the frequency."""
_ITERATIONS = 10
"""Steps of their fit, each with the weights of the step before."""
NORMAL_95 = 1.96
"""Half the width of a 95 % interval [standard deviations]."""


class ScaleVariance(NamedTuple):
    """Variance at one time scale."""

    samples: int
    """Samples of each of the two means."""
    variance: float
    """[N²]"""
    deviation: float
    """Its standard deviation where the noise was observed [N²]."""
    extrapolated: float = 0.0
    """Standard deviation of the part at frequencies where it was not observed [N²]."""

    @classmethod
    def from_signal(cls, samples: int, variance: float, differences: int) -> "ScaleVariance":
        """Return the variance [N²] of a signal at a scale, as measured by some differences."""
        scale = cls(samples, variance, 0.0)
        return scale._replace(deviation=scale.compute_chance(differences))

    @property
    def uncertainty(self) -> float:
        """Standard deviation with that of the extrapolated part [N²]."""
        return math.hypot(self.deviation, self.extrapolated)

    def multiply(self, factor: float) -> "ScaleVariance":
        """Return the variance of a signal whose power is larger by a factor [1]."""
        return ScaleVariance(self.samples, *(factor * value for value in self[1:]))

    def compute_chance(self, differences: int) -> float:
        """Return by how much the variance of another signal with some differences varies by chance [N²].

        A difference every 2 m samples is independent, and the variance of k of them varies by sqrt(2 / k).
        """
        return self.variance * math.sqrt(4.0 * self.samples / differences)


class SlowVariance(NamedTuple):
    """Variance of 1/f noise in each factor e of the frequency; it is the same at all frequencies."""

    variance: float
    """[N²]"""
    deviation: float
    """Its standard deviation [N²]."""

    @property
    def highest(self) -> float:
        """Upper end of the 95 % interval [N²]."""
        return self.variance + NORMAL_95 * self.deviation


NO_SLOW_VARIANCE = SlowVariance(0.0, 0.0)
"""Slow variance of noise without a 1/f part, or of unknown noise."""


def list_scales(count: int) -> Iterator[int]:
    """Yield the scales [samples] of which a signal of some samples contains enough separate differences."""
    samples = 1
    while 2 * samples * _FEWEST_DIFFERENCES <= count:
        yield samples
        samples *= 2


def compute_gain(frequency: Array, samples: int) -> Array:
    """Return the part (B,) of the power that a scale contains [1], at frequencies (B,) in cycles a sample."""
    angle = np.pi * np.maximum(frequency, 1e-12)
    return np.asarray((np.sin(angle * samples) ** 2 / (samples * np.sin(angle))) ** 2)


def measure_scale_variance(values: Array, valid: BoolArray, samples: int) -> tuple[float, int]:
    """Return the variance [N²] of a signal (N,) [N] at a scale, and the number of differences in it.

    Only differences without an invalid sample count; the variance is zero without any.
    """
    sums = np.concatenate([[0.0], np.cumsum(np.where(valid, values, 0.0))])
    counts = np.concatenate([[0], np.cumsum(valid)])
    if len(values) < 2 * samples:
        return 0.0, 0
    first, second = sums[samples:-samples] - sums[: -2 * samples], sums[2 * samples :] - sums[samples:-samples]
    whole = counts[2 * samples :] - counts[: -2 * samples] == 2 * samples
    differences = (second - first)[whole] / (2.0 * samples)
    return float(np.mean(differences**2)) if len(differences) else 0.0, len(differences)


def compute_deviations(columns: Array) -> Array:
    """Return the standard deviations (P,) of a linear fit with columns (N, P) over the deviations of the data."""
    return np.asarray(np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns))))


def average_scales(
    parts: Sequence[Sequence[ScaleVariance]], weights: Sequence[float]
) -> tuple[ScaleVariance, ...]:
    """Return the mean variances of independent signals at the scales that all of them have."""
    shares = np.array(weights, float) / sum(weights)
    return tuple(
        ScaleVariance(
            same[0].samples,
            float(shares @ [s.variance for s in same]),
            float(np.linalg.norm(shares * [s.deviation for s in same])),
            float(shares @ [s.extrapolated for s in same]),
        )
        for same in zip(*parts, strict=False)
    )


def estimate_slow_variance(scales: Sequence[ScaleVariance]) -> SlowVariance:
    """Estimate the variance of 1/f noise from the longest scales; it is zero without any.

    White noise has half of the variance of each scale at the next longer one. 1/f noise has the same at all, and
    each scale contains one octave.
    """
    slowest = scales[-_SLOW_SCALES:]
    if not slowest or min(s.variance for s in slowest) <= 0.0:
        return NO_SLOW_VARIANCE
    variance = np.array([s.variance for s in slowest])
    columns = np.array([[slowest[0].samples / s.samples, 1.0] for s in slowest])
    relative, level = np.array([s.deviation / s.variance for s in slowest]), variance
    for _ in range(_ITERATIONS):
        # A variance that is small by chance also has a small standard deviation, so that of the fit counts.
        weights = 1.0 / (relative * level)
        parts = nnls(columns * weights[:, None], variance * weights)[0]
        level = columns @ parts
    deviation = compute_deviations(columns / (relative * level)[:, None])[1]
    return SlowVariance(float(parts[1]) / math.log(2.0), deviation / math.log(2.0))
