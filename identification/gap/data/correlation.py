"""Correlation length of a residual: how many neighbouring samples have the same error."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array


def compute_correlation_length(values: Array) -> float:
    """Return the integral of the autocorrelation of a series (N,) up to its first zero [samples]; at least one.

    A series of zeros has the length one.
    """
    spectrum = np.abs(np.fft.rfft(values, 2 * len(values))) ** 2
    correlation = np.fft.irfft(spectrum)[: len(values)]
    if correlation[0] <= 0.0:
        return 1.0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation < 0.0)
    end = int(negative[0]) if len(negative) else len(correlation)
    return float(1.0 + 2.0 * np.sum(correlation[1:end]))


def compute_residual_correlation_length(residuals: Sequence[Array]) -> float:
    """Return the correlation length [samples] of the longest of some residuals (N,), about its mean."""
    longest = max(residuals, key=len)
    return compute_correlation_length(longest - longest.mean())
