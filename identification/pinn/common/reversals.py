"""Reversals of the slip x - y, at which the hysteresis turns; they differ from the reversals of the stroke x.

The inner point lags. The slip velocity w = x' - y' changes sign some ten milliseconds before x' does. It stays
near zero while y' follows x', and grows after the breakthrough. Near zero its sign is arbitrary. A reversal is
therefore an extreme of the slip itself, which the slip leaves by more than a fraction of the yield displacement.
"""

import numpy as np

from identification.arrays import Array

REVERSAL_THRESHOLD = 0.5
"""Threshold on an excursion of the slip, over the yield displacement [1]: a smaller one hardly turns the loop."""


def integrate_slip(time: Array, slip_velocity: Array) -> Array:
    """Return the slip [m] (N,) since the first of times (N,) [s], by the trapezoidal rule."""
    steps = 0.5 * (slip_velocity[1:] + slip_velocity[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def find_turning_points(values: Array, threshold: float) -> list[int]:
    """Return the indices of the extremes of a signal (N,) that it leaves by more than a threshold."""
    indices: list[int] = []
    high = low = 0
    direction = 0
    for i, value in enumerate(values.tolist()):
        high = i if value > values[high] else high
        low = i if value < values[low] else low
        if direction >= 0 and values[high] - value > threshold:
            indices += [high] if direction else []
            direction, low = -1, i
        elif direction <= 0 and value - values[low] > threshold:
            indices += [low] if direction else []
            direction, high = 1, i
    return indices


def find_reversals(time: Array, slip_velocity: Array, yield_displacement: float) -> Array:
    """Return the times [s] of the slip's reversals, interpolated to the zeros of the slip velocity.

    Args:
        time: times (N,) [s].
        slip_velocity: slip velocity x' - y' (N,) [m/s].
        yield_displacement: slip over which the hysteresis turns [m].
    """
    slip = integrate_slip(time, slip_velocity)
    # A threshold, because noise of the slip velocity crosses zero many times around one reversal.
    turning_points = find_turning_points(slip, REVERSAL_THRESHOLD * yield_displacement)
    return np.array([_interpolate_zero(time, slip_velocity, i) for i in turning_points])


def _interpolate_zero(time: Array, values: Array, i: int) -> float:
    """Return the time [s] of the zero next to a sample; without a change of sign, that of the sample."""
    for k in (i - 1, i):
        if 0 <= k < len(time) - 1 and values[k] * values[k + 1] < 0:
            fraction = values[k] / (values[k] - values[k + 1])
            return float(time[k] + fraction * (time[k + 1] - time[k]))
    return float(time[i])
