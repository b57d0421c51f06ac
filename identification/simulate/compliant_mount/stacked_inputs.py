"""Inputs of the integration on a compliant mount as arrays, and their interpolation between the samples.

``g`` holds the seven inputs at one instant: x, u, factors of alpha, c0 and c1, parallel force, x'.
"""

import numpy as np

from identification.arrays import Array, njit_cached
from identification.simulate.curves import interpolate_midpoints
from identification.simulate.inputs import DamperField
from identification.simulate.motion import DamperMotion
from identification.simulate.scaling import ScaleFactors
from identification.simulate.step import interpolate_motion, interpolate_parabola

INPUT_COUNT = 7


def stack_inputs(
    motion: DamperMotion, field: DamperField, scales: ScaleFactors, parallel_force: Array, h: float
) -> tuple[Array, Array]:
    """Return the seven inputs at the samples (7, N) and half way between them (7, N-1)."""
    x, v = interpolate_midpoints(motion.x, motion.v, h)
    ones, middles = np.ones((3, len(motion.x))), np.ones((3, len(x)))
    scaled = scales.values.shape[1] > 0
    between = 0.5 * (parallel_force[1:] + parallel_force[:-1])
    at = np.vstack([motion.x, field.u, scales.values if scaled else ones, parallel_force, motion.v])
    middle = np.vstack([x, field.middle, scales.midpoints if scaled else middles, between, v])
    return np.ascontiguousarray(at), np.ascontiguousarray(middle)


def stack_derivatives(
    motion: DamperMotion,
    field: DamperField,
    scales: ScaleFactors,
    over_motion: Array,
    own: list[tuple[int, Array]],
    h: float,
) -> tuple[Array, Array]:
    """Return the derivatives of the inputs, (E, 7, N) at the samples and (E, 7, N-1) half way between.

    The E unknowns are those of field, motion and factors, then those of parallel forces.
    """
    first, count = len(field.du) - 1, len(motion.x)
    inner = first + max(1 + len(motion.columns), len(scales.derivatives))
    at = np.zeros((inner + len(own), INPUT_COUNT, count))
    middle = np.zeros((inner + len(own), INPUT_COUNT, count - 1))
    at[: first + 1, 1], middle[: first + 1, 1] = field.du, field.dmiddle
    moving = slice(first, first + len(motion.dx))
    at[moving, 0], at[moving, 6] = motion.dx, motion.dv
    middle[moving, 0], middle[moving, 6] = interpolate_midpoints(motion.dx, motion.dv, h)
    scaling = slice(first, first + len(scales.derivatives))
    if len(scales.derivatives):
        at[scaling, 2:5], middle[scaling, 2:5] = scales.derivatives, scales.midpoint_derivatives
    at[moving, 5] = over_motion
    for k, (_, row) in enumerate(own):
        at[inner + k, 5] = row
    middle[:, 5] = 0.5 * (at[:, 5, 1:] + at[:, 5, :-1])
    return at, middle


@njit_cached
def interpolate_inputs(g: Array, at: Array, middle: Array, h: float, i: int, t: float) -> None:
    """Write the inputs at the fraction t of sample i into g (7,); a Hermite cubic interpolates the motion."""
    for k in range(INPUT_COUNT):
        g[k] = at[k, i]
    if t > 0.0:
        g[0], g[6] = interpolate_motion(at[0, i], at[0, i + 1], at[6, i], at[6, i + 1], h, t)
        for k in range(1, INPUT_COUNT - 1):
            g[k] = interpolate_parabola(at[k, i], middle[k, i], at[k, i + 1], t)
