"""Where the hysteresis turns: reversals of the slip x - y, not of the stroke x.

The inner point lags: the slip velocity w = x' - y' changes sign some ten milliseconds before x' does, creeps
about zero while y' follows x', and breaks through later. While it creeps its sign means nothing, so a reversal
is an extreme of the slip itself that is left by more than a fraction of the yield displacement.
"""

import numpy as np

from identification.arrays import Array

EXCURSION = 0.5
"""[1] of the yield displacement: a smaller excursion hardly bends the loop."""


def turning_points(values: Array, threshold: float) -> list[int]:
    """Indices of the extremes of a signal (N,) that it leaves by more than a threshold, in their order."""
    found: list[int] = []
    high = low = 0
    direction = 0
    for i, value in enumerate(values.tolist()):
        high = i if value > values[high] else high
        low = i if value < values[low] else low
        if direction >= 0 and values[high] - value > threshold:
            found += [high] if direction else []
            direction, low = -1, i
        elif direction <= 0 and value - values[low] > threshold:
            found += [low] if direction else []
            direction, high = 1, i
    return found


def reversals(time: Array, slip_velocity: Array, yield_displacement: float) -> Array:
    """Times [s] at which the slip turns, between samples where the slip velocity crosses zero.

    Args:
        time: (N,) [s].
        slip_velocity: (N,) x' - y' [m/s].
        yield_displacement: slip over which the loop turns [m].
    """
    steps = 0.5 * (slip_velocity[1:] + slip_velocity[:-1]) * np.diff(time)
    slip = np.concatenate([[0.0], np.cumsum(steps)])
    found = []
    for i in turning_points(slip, EXCURSION * yield_displacement):
        at = [k for k in (i - 1, i) if 0 <= k < len(time) - 1 and slip_velocity[k] * slip_velocity[k + 1] < 0]
        if not at:
            found.append(float(time[i]))
            continue
        k = at[0]
        share = slip_velocity[k] / (slip_velocity[k] - slip_velocity[k + 1])
        found.append(float(time[k] + share * (time[k + 1] - time[k])))
    return np.array(found)
