"""Displacement with its two exact derivatives, and smooth curves that start, stop and connect strokes.

All derivatives are formulas, not differences of samples, so that velocity and acceleration contain no noise. Soft
starts and moves use the quintic ``s^3 (10 - 15 s + 6 s^2)``: its velocity and acceleration are zero at both ends.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
"""Array of real numbers in SI units; docstrings state shape and unit."""

QUINTIC_PEAK_RATE = 1.875
"""Largest first derivative of the quintic step over its unit length."""
QUINTIC_PEAK_CURVATURE = 10 / math.sqrt(3)
"""Largest second derivative of the quintic step over its unit length."""

MOVE_GRID = 0.1
"""Unit [s] of the duration of moves, so that the next part starts on a sample at usual rates."""


class Kinematics(NamedTuple):
    """Samples of a motion; each array has shape (samples,)."""

    displacement: Array
    """[m], positive in extension."""
    velocity: Array
    """Exact derivative of the displacement [m/s]."""
    acceleration: Array
    """Exact derivative of the velocity [m/s²]; it may jump in a motion with rounded corners."""

    def shift(self, centre: float) -> "Kinematics":
        """Return the same motion about another centre [m]."""
        return self._replace(displacement=self.displacement + centre)


def make_rest(time: Array) -> Kinematics:
    """Return rest at displacement zero, for times [s] of shape (samples,)."""
    zero = np.zeros_like(time)
    return Kinematics(zero, zero, zero)


def compute_smooth_step(share: Array) -> Kinematics:
    """Compute the quintic from 0 to 1 for ``share`` in 0..1, with its derivatives; it is constant outside."""
    s = np.clip(share, 0.0, 1.0)
    return Kinematics(
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2,
        60 * s * (1 - s) * (1 - 2 * s),
    )


def compute_move(start: float, end: float, duration: float, time: Array) -> Kinematics:
    """Compute a move from rest at ``start`` to ``end`` [m] in ``duration`` [s], at times [s] from its start."""
    step = compute_smooth_step(time / duration)
    distance = end - start
    return Kinematics(
        start + distance * step.displacement,
        distance * step.velocity / duration,
        distance * step.acceleration / duration**2,
    )


def compute_move_duration(distance: float, velocity: float, acceleration: float) -> float:
    """Compute the duration [s] of a move [m] with limits on velocity [m/s] and acceleration [m/s²]."""
    by_velocity = QUINTIC_PEAK_RATE * abs(distance) / velocity
    by_acceleration = math.sqrt(QUINTIC_PEAK_CURVATURE * abs(distance) / acceleration)
    return MOVE_GRID * math.ceil(max(by_velocity, by_acceleration) / MOVE_GRID)


def apply_fade(steady: Kinematics, time: Array, duration: float, fade: float) -> Kinematics:
    """Fade a motion in from rest before time zero, and out to rest after ``duration``.

    Args:
        steady: motion about displacement zero, which continues before and after its counted part.
        time: [s] of shape (samples,), zero at the start of the counted part.
        duration: duration of the counted part [s], which is not changed.
        fade: duration of the soft start and of the soft stop [s].
    """
    rising = time < duration / 2
    step = compute_smooth_step(np.where(rising, time + fade, duration + fade - time) / fade)
    size = step.displacement
    rate = np.where(rising, 1.0, -1.0) * step.velocity / fade
    curvature = step.acceleration / fade**2
    return Kinematics(
        size * steady.displacement,
        size * steady.velocity + rate * steady.displacement,
        size * steady.acceleration + 2 * rate * steady.velocity + curvature * steady.displacement,
    )
