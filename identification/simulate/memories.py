"""Memories of functional forms along a field or a displacement, and the memory of the law at the first sample."""

from typing import Any

import numpy as np

from identification.arrays import Array, njit_uncached

_REST_SHARE = 0.05
"""Initial speed over the highest speed [1] below which the damper counts as resting, not as sliding."""


@njit_uncached
def trace_memory(memory: Any, count: int, rise: float, u: Array, *values: float) -> Array:
    """Return the mean of a form's memories (N,) along a field (N,).

    Args:
        memory, count: function and number of the memories.
        rise: change to the first field, over that field, since the memories were zero [1].
        u: field [V or A].
        values: parameters of the form.
    """
    found, memories = np.zeros(len(u)), np.zeros(count)
    last, mean = (1.0 - rise) * u[0], 0.0
    for i in range(len(u)):
        change, last = u[i] - last, u[i]
        # Most of a drive is constant, and a constant drive does not change the memory.
        if change != 0.0:
            for m in range(count):
                memories[m] = memory(memories[m], change, (m + 0.5) / count, *values)
            mean = memories.mean()
        found[i] = mean
    return found


@njit_uncached
def trace_path_memory(memory: Any, x: Array, v: Array, *values: float) -> Array:
    """Return the memory of a form along a displacement (N,) [m] at velocities (N,) [m/s]; it starts at zero."""
    found = np.zeros(len(x))
    for i in range(1, len(x)):
        change = x[i] - x[i - 1]
        found[i] = found[i - 1]
        if change != 0.0:
            found[i] = memory(found[i - 1], change, 0.5 * (v[i - 1] + v[i]), *values)
    return found


def estimate_settled_hysteresis(velocity: Array) -> float:
    """Estimate the initial hysteretic variable [1] from a velocity (N,) [m/s]: saturated in motion, zero at rest.

    The first velocity contains noise. Near rest the variable follows its square, so that noise hardly moves it.
    """
    rest = _REST_SHARE * float(np.abs(velocity).max())
    ratio = float(velocity[0]) / max(rest, np.finfo(float).tiny)
    return ratio * abs(ratio) / (1.0 + ratio**2)
