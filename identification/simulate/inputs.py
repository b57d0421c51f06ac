"""What reaches the damper: the field behind the drive, and the displacement behind the mounting.

Each comes with its derivatives over the unknowns that shape it, which the kernel carries on to the force.
"""

import math

import numpy as np

from identification.arrays import Array, compiled


@compiled
def field(drive: Array, eta: float, delay: float, h: float) -> tuple[Array, Array, Array, Array]:
    """Field u behind a drive that is held between samples and arrives ``delay`` [s] late (eq. 8).

    Args:
        drive: (N,) measured drive [V or A].
        eta: rate constant [1/s].
        delay: [s] of either sign; the field starts in equilibrium with the first drive.
        h: time between samples [s].

    Returns:
        u (N,), u half way between samples (N-1,), and their derivatives over eta and delay,
        (2, N) and (2, N-1).
    """
    count = len(drive)
    u, middle = np.empty(count), np.empty(count - 1)
    du, dmiddle = np.zeros((2, count)), np.zeros((2, count - 1))
    whole = math.floor(delay / h)
    early = delay / h - whole
    value, over_eta = drive[0], 0.0
    u[0] = value
    for i in range(count - 1):
        old = drive[min(max(i - whole - 1, 0), count - 1)]
        new = drive[min(max(i - whole, 0), count - 1)]
        if early < 0.5:
            middle[i], dmiddle[0, i] = _decay(value, over_eta, old, new, eta, early * h, (0.5 - early) * h)
            dmiddle[1, i] = eta * (middle[i] - new)
        else:
            middle[i], dmiddle[0, i] = _decay(value, over_eta, old, old, eta, 0.5 * h, 0.0)
            dmiddle[1, i] = eta * (middle[i] - old)
        value, over_eta = _decay(value, over_eta, old, new, eta, early * h, (1.0 - early) * h)
        u[i + 1], du[0, i + 1] = value, over_eta
        du[1, i + 1] = eta * (value - new)
    return u, middle, du, dmiddle


@compiled
def _decay(
    value: float, over_eta: float, old: float, new: float, eta: float, first: float, second: float
) -> tuple[float, float]:
    """Field and its slope over eta after ``first`` [s] towards ``old``, then ``second`` [s] towards ``new``."""
    fade = math.exp(-eta * first)
    slope = (over_eta - first * (value - old)) * fade
    value = old + (value - old) * fade
    fade = math.exp(-eta * second)
    return new + (value - new) * fade, (slope - second * (value - new)) * fade


@compiled
def settled_hysteresis(velocity: float) -> float:
    """Hysteretic state [1] to start from at a velocity [m/s]: saturated in motion, relaxed at rest."""
    slow = 1e-3
    return velocity / (abs(velocity) + slow)
