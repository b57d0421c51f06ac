"""Factors on alpha, c0 and c1 along an excitation from effects that scale the law, and their derivatives."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array
from identification.simulate.curves import (
    differentiate_by_argument,
    differentiate_by_parameters,
    interpolate_midpoints,
)
from identification.simulate.motion import DamperMotion
from identification.simulate.simulation_model import Excitation, SimulationModel
from identification.simulate.stored_energy import compute_stored_energy
from identification.simulate.variables import DamperVariables, MovedVariables

_DISPLACEMENT_STEP, _VELOCITY_STEP = 1e-7, 1e-6
"""Steps of differences [m], [m/s]."""


class ScaleFactors(NamedTuple):
    """Factors [1] on alpha, c0 and c1, and their derivatives over the motion's unknowns and their parameters."""

    values: Array
    """(3, N) factors at the samples; (3, 0) without scaling."""
    midpoints: Array
    """(3, N-1) factors half way between the samples."""
    derivatives: Array
    """(S, 3, N) derivatives of ``values``."""
    midpoint_derivatives: Array
    """(S, 3, N-1) derivatives of ``midpoints``."""
    columns: tuple[int, ...]
    """Columns of the parameters of scaling effects, among the parameters of all effects."""


def compute_scale_factors(
    model: SimulationModel, excitation: Excitation, motion: DamperMotion, sensitivities: bool = True
) -> ScaleFactors:
    """Compute the factors of all scaling effects; derivatives only with ``sensitivities``."""
    scaling = model.select_forms("scaling", "softening", "gain_function")
    if not scaling:
        return ScaleFactors(np.ones((3, 0)), np.ones((3, 0)), np.ones((0, 3, 0)), np.ones((0, 3, 0)), ())
    h = 1.0 / excitation.rate
    x, v = interpolate_midpoints(motion.x, motion.v, h)
    dx, dv = interpolate_midpoints(motion.dx, motion.dv, h)
    # No scaling effect depends on the acceleration. x fills its two places.
    middle = DamperMotion(x, v, x, dx, dv, x, motion.columns)
    columns = tuple(at + k for at, _, values in scaling for k in range(len(values)))
    variables = DamperVariables(excitation, motion.x, motion.v, motion.a)
    parts = [_bind_form(form, values, variables, excitation, half=False) for _, form, values in scaling]
    parts_between = [_bind_form(form, values, variables, excitation, half=True) for _, form, values in scaling]
    at, over = _multiply_factors(parts, motion, sensitivities=sensitivities)
    at_middle, over_middle = _multiply_factors(parts_between, middle, sensitivities=sensitivities)
    return ScaleFactors(at, at_middle, over, over_middle, columns)


def _multiply_factors(
    parts: Sequence["_FormFactor"], motion: DamperMotion, *, sensitivities: bool
) -> tuple[Array, Array]:
    """Return the product of all factors (3, N) and its derivatives (S, 3, N)."""
    total = np.prod([part.function(motion.x, motion.v, *part.values) for part in parts], axis=0)
    if not sensitivities:
        return total, np.ones((0, 3, 0))
    relative = np.zeros((len(motion.dx), 3, len(motion.x)))
    own = []
    for part in parts:
        alone = part.function(motion.x, motion.v, *part.values)
        relative += part.differentiate_by_motion(motion) / alone
        rows = differentiate_by_parameters(
            partial(part.function, motion.x, motion.v), part.values, part.quantities
        )
        own += [row / alone for row in rows]
    return total, np.concatenate([relative, np.stack(own)]) * total


class _FormFactor(NamedTuple):
    """Factors of one form as a function of displacement and velocity."""

    function: Callable[..., Array]
    values: tuple[float, ...]
    quantities: Any

    def differentiate_by_motion(self, motion: DamperMotion) -> Array:
        """Differentiate the factors over the unknowns of the motion, (M, 3, N)."""

        def at_displacement(x: Array) -> Array:
            return self.function(x, motion.v, *self.values)

        def at_velocity(v: Array) -> Array:
            return self.function(motion.x, v, *self.values)

        over_x = differentiate_by_argument(at_displacement, motion.x, _DISPLACEMENT_STEP)
        over_v = differentiate_by_argument(at_velocity, motion.v, _VELOCITY_STEP)
        return np.asarray(over_x * motion.dx[:, None, :] + over_v * motion.dv[:, None, :])


def _bind_form(
    form: Any, values: tuple[float, ...], variables: DamperVariables, excitation: Excitation, *, half: bool
) -> _FormFactor:
    """Return the factors of a form over the motion, at the samples or half way between."""
    if form.action == "gain_function":
        return _FormFactor(partial(_evaluate_gain, form, variables), values, form.parameters)
    if form.action == "scaling":
        return _FormFactor(lambda x, v, *own: np.stack(form.function(x, v, *own)), values, form.parameters)
    recovery = [q.symbol for q in form.parameters].index("recovery_time")

    def warmed(x: Array, v: Array, *own: float) -> Array:
        energy = compute_stored_energy(excitation, own[recovery])
        energy = 0.5 * (energy[1:] + energy[:-1]) if half else energy
        return np.stack(form.function(energy, *own))

    return _FormFactor(warmed, values, form.parameters)


def _evaluate_gain(form: Any, samples: DamperVariables, x: Array, v: Array, *own: float) -> Array:
    """Return the factors (3, N) of a defined effect at a motion near that of the samples."""
    return np.stack([1.0 + form.function(MovedVariables(samples, x, v), *own)] * 3)
