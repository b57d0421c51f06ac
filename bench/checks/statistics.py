"""Means of a recorded quantity at rest, with uncertainties that allow for correlated samples."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class TimedSamples(NamedTuple):
    """Samples of one channel in its unit, and their times [s]; both of shape (samples,)."""

    time: Array
    values: Array

    def remove_drift(self, slope: float, time: float) -> Array:
        """Return the values without a drift [unit/s] that is zero at a time [s]."""
        return self.values - slope * (self.time - time)


class RestStatistics(NamedTuple):
    """Statistics of one channel at rest, in its unit."""

    mean: float
    standard_deviation: float
    samples: int
    independent_samples: float
    """Number of independent samples with the same uncertainty of the mean."""

    @property
    def standard_uncertainty(self) -> float:
        """Standard uncertainty of the mean (JCGM 100:2008, 4.2.3) for the number of independent samples."""
        return self.standard_deviation / math.sqrt(self.independent_samples)


def compute_statistics(values: Array) -> RestStatistics:
    """Compute the statistics of at least two samples, shape (samples,)."""
    samples = len(values)
    deviation = float(np.std(values, ddof=1))
    independent = samples / estimate_correlation(values)
    return RestStatistics(float(np.mean(values)), deviation, samples, independent)


class Difference(NamedTuple):
    """Difference of a mean from the means before and after it, in the unit of the samples."""

    value: float
    standard_uncertainty: float
    """Standard uncertainty of the three means, combined (JCGM 100:2008, 5.1)."""
    statistics: RestStatistics
    """Statistics of the samples between the others."""


def compute_difference(before: TimedSamples, between: TimedSamples, after: TimedSamples) -> Difference:
    """Compute how far the mean of samples differs from the line through the means before and after them.

    A linear drift therefore has no influence, neither on the value nor on its uncertainty.

    Args:
        before: at least two samples.
        between: at least two samples, later than these.
        after: at least two samples, later than these.
    """
    first, middle, last = (float(np.mean(one.time)) for one in (before, between, after))
    slope = float(np.mean(after.values) - np.mean(before.values)) / (last - first)
    share = (middle - first) / (last - first)
    earlier, inner, later = (
        compute_statistics(one.remove_drift(slope, middle)) for one in (before, between, after)
    )
    variance = (
        inner.standard_uncertainty**2
        + ((1 - share) * earlier.standard_uncertainty) ** 2
        + (share * later.standard_uncertainty) ** 2
    )
    return Difference(inner.mean - earlier.mean, math.sqrt(variance), inner)


def estimate_correlation(values: Array) -> float:
    """Estimate how many successive samples are worth one independent sample.

    It is 1 + 2 Σ autocorrelation, up to the first pair of lags whose sum is not positive (Geyer 1992, initial
    positive sequence). A slow drift counts as correlation, because it does not average out.

    Returns:
        At least 1; the number of samples if all of them are equal.
    """
    samples = len(values)
    deviations = values - np.mean(values)
    # Twice the length, so that the end is not correlated with the beginning.
    spectrum = np.abs(np.fft.rfft(deviations, 2 * samples)) ** 2
    covariances = np.fft.irfft(spectrum)[:samples]
    if not covariances[0] > 0:
        return float(samples)
    pairs = (covariances[: samples // 2 * 2] / covariances[0]).reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    stop = int(ends[0]) if ends.size else len(pairs)
    return float(np.clip(2 * pairs[:stop].sum() - 1, 1, samples))
