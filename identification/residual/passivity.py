"""Limit of a residual force that keeps the damper passive: it returns no more energy than it has absorbed.

The absorbed energy is a store that starts empty. The residual may feed power into the rod only while the store is
not empty. Otherwise it is zero (energy tank, Franken et al. 2011, IEEE Transactions on Robotics 27).
"""

import numpy as np

from identification.arrays import Array, njit_cached


def limit_residual(law_force: Array, residual: Array, velocity: Array, rate: float) -> Array:
    """Return the residual force (N,) [N] with which law and residual together stay passive.

    Args:
        law_force: (N,) force of law and effects [N].
        residual: (N,) learned residual force [N].
        velocity: (N,) velocity of the rod [m/s].
        rate: sampling rate [Hz].
    """
    return np.asarray(_limit(law_force, residual, velocity, 1.0 / rate))


@njit_cached
def _limit(law_force: Array, residual: Array, velocity: Array, h: float) -> Array:
    limited = residual.copy()
    absorbed = 0.0
    for i in range(len(limited)):
        law, own = law_force[i] * velocity[i] * h, limited[i] * velocity[i] * h
        if own < 0.0 and absorbed + law + own < 0.0:
            limited[i] = own = 0.0
        absorbed = max(absorbed + law + own, 0.0)
    return limited
