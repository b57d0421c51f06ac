"""95 % intervals of effect parameters."""

import math

from identification.uncertainty import Z95_ROUNDED, clip_interval, make_interval


def compute_interval(value: float, deviation: float, low: float, high: float) -> tuple[float, float]:
    """Return the 95 % interval inside the bounds, on the logarithm where the value cannot be zero."""
    if not math.isfinite(deviation):
        return min(low, value), max(high, value)
    return clip_interval(make_interval(value, deviation, Z95_ROUNDED, positive=low > 0), value, low, high)
