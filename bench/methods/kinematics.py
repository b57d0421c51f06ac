"""Displacement with its two exact derivatives, and the smooth curves that start, stop and join strokes.

Every curve here is a formula, never a difference of samples, so velocity and acceleration of a programme carry
no noise. Soft starts and moves use the quintic ``s^3 (10 - 15 s + 6 s^2)``, which leaves and arrives with zero
velocity and zero acceleration.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
"""Real numbers in SI units; the docstring at hand gives shape and unit."""

QUINTIC_PEAK_RATE = 1.875
"""[1] largest slope of the quintic step over its unit length."""
QUINTIC_PEAK_CURVATURE = 10 / math.sqrt(3)
"""[1] largest second derivative of the quintic step over its unit length."""

MOVE_GRID = 0.1
"""[s] moves take a multiple of this, so that what follows them starts on a sample at usual rates."""


class Kinematics(NamedTuple):
    """A motion on its samples, each array of shape (samples,)."""

    displacement: Array
    """[m] positive extends the damper."""
    velocity: Array
    """[m/s] its exact derivative."""
    acceleration: Array
    """[m/s²] the derivative of that; it may jump where a motion has rounded corners."""

    def about(self, centre: float) -> "Kinematics":
        """The same motion about another centre [m]."""
        return self._replace(displacement=self.displacement + centre)


def at_rest(time: Array) -> Kinematics:
    """No motion, at displacement zero, for times [s] of shape (samples,)."""
    zero = np.zeros_like(time)
    return Kinematics(zero, zero, zero)


def smooth_step(share: Array) -> Kinematics:
    """The quintic from 0 to 1 over ``share`` in 0..1 with its derivatives over ``share``; flat outside."""
    s = np.clip(share, 0.0, 1.0)
    return Kinematics(
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2,
        60 * s * (1 - s) * (1 - 2 * s),
    )


def move(start: float, end: float, duration: float, time: Array) -> Kinematics:
    """From rest at ``start`` to rest at ``end`` [m] within ``duration`` [s], for times [s] from the start."""
    step = smooth_step(time / duration)
    way = end - start
    return Kinematics(
        start + way * step.displacement,
        way * step.velocity / duration,
        way * step.acceleration / duration**2,
    )


def move_duration(way: float, velocity: float, acceleration: float) -> float:
    """Time [s] that a move over ``way`` [m] needs to stay below a velocity [m/s] and an acceleration [m/s²]."""
    by_velocity = QUINTIC_PEAK_RATE * abs(way) / velocity
    by_acceleration = math.sqrt(QUINTIC_PEAK_CURVATURE * abs(way) / acceleration)
    return MOVE_GRID * math.ceil(max(by_velocity, by_acceleration) / MOVE_GRID)


def faded(steady: Kinematics, time: Array, duration: float, fade: float) -> Kinematics:
    """A stroke that swells from rest before time zero and dies down to rest after ``duration``.

    Args:
        steady: the motion about displacement zero, going on before and after its counted part.
        time: [s] of shape (samples,), zero where the counted part begins.
        duration: length of the counted part [s], within which nothing is changed.
        fade: length of the start and of the stop [s].
    """
    rising = time < duration / 2
    step = smooth_step(np.where(rising, time + fade, duration + fade - time) / fade)
    size = step.displacement
    rate = np.where(rising, 1.0, -1.0) * step.velocity / fade
    curvature = step.acceleration / fade**2
    return Kinematics(
        size * steady.displacement,
        size * steady.velocity + rate * steady.displacement,
        size * steady.acceleration + 2 * rate * steady.velocity + curvature * steady.displacement,
    )
