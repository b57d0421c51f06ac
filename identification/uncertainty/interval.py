"""Confidence intervals of a normally distributed estimate."""

import numpy as np

Z95, Z99 = 1.959964, 2.575829
"""Half widths of the 95 % and 99 % intervals, in standard deviations [1]."""
Z95_ROUNDED = 1.96
"""Rounded half width of the 95 % interval [1]; diagnoses and trends are computed with it."""
_MAX_LOG_WIDTH = 50.0
"""Largest half width on the logarithm [1]: e^50 bounds no quantity any more, and far beyond it exp overflows."""


def make_interval(value: float, deviation: float, quantile: float, *, positive: bool) -> tuple[float, float]:
    """Return the interval of ``quantile`` standard deviations, on the logarithm for a positive quantity."""
    if positive:
        factor = float(np.exp(min(quantile * deviation / value, _MAX_LOG_WIDTH)))
        return value / factor, value * factor
    return value - quantile * deviation, value + quantile * deviation


def clip_interval(interval: tuple[float, float], value: float, low: float, high: float) -> tuple[float, float]:
    """Return the part of an interval inside the bounds of a quantity; it always contains the value."""
    return min(max(interval[0], low), value), max(min(interval[1], high), value)
