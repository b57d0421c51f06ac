"""Robust estimates of white noise, from medians."""

import math

import numpy as np

from identification.arrays import Array

_MEDIAN_MAGNITUDE = 0.6745
"""Median magnitude of a standard normal variable (dimensionless)."""


def estimate_deviation(values: Array) -> float:
    """Return the standard deviation of normal values (N,), from their median magnitude."""
    return float(np.median(np.abs(values))) / _MEDIAN_MAGNITUDE


def estimate_white_noise(values: Array, order: int) -> float:
    """Return the standard deviation of white noise in a signal (N,), from its differences of an order.

    The differences remove a polynomial of lower degree, and the median ignores steps. The result is too large if
    the signal itself changes as fast as the noise.
    """
    differences = np.diff(values, order)
    # The difference of order k has (2k choose k) times the variance of the noise.
    return estimate_deviation(differences) / math.sqrt(math.comb(2 * order, order)) if len(differences) else 0.0
