"""Mean of a recorded quantity at rest, with an uncertainty that allows for correlated samples."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


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
