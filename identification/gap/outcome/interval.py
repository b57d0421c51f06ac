"""95 % intervals of effect parameters."""

import numpy as np

NORMAL_QUANTILE = 1.96
"""Half width of a 95 % interval of a normal distribution [standard deviations]."""
_MAX_LOG_WIDTH = 50.0
"""Largest half width of an interval on the logarithm; it prevents an overflow."""


def compute_interval(value: float, deviation: float, low: float, high: float) -> tuple[float, float]:
    """Return the 95 % interval inside the bounds, on the logarithm where the value cannot be zero."""
    if not np.isfinite(deviation):
        return min(low, value), max(high, value)
    if low > 0:
        factor = float(np.exp(min(NORMAL_QUANTILE * deviation / value, _MAX_LOG_WIDTH)))
        interval = value / factor, value * factor
    else:
        interval = value - NORMAL_QUANTILE * deviation, value + NORMAL_QUANTILE * deviation
    return min(max(interval[0], low), value), max(min(interval[1], high), value)
