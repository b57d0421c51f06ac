"""Factors on alpha, c0 and c1 along an excitation from effects that scale the law, and their derivatives."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.effects import Form
from identification.simulate.curves import differentiate_by_argument, interpolate_midpoints
from identification.simulate.dual import differentiate, evaluate_by_differences
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
    if not sensitivities:
        return np.prod([part.evaluate(motion.x, motion.v) for part in parts], axis=0), np.ones((0, 3, 0))
    total: Any = 1.0
    relative = np.zeros((len(motion.dx), 3, len(motion.x)))
    own = []
    for part in parts:
        alone, rows = differentiate(partial(part.function, motion.x, motion.v), part.values)
        total = total * alone
        relative += part.differentiate_by_motion(motion) / alone
        own += [row / alone for row in rows]
    return total, np.concatenate([relative, np.stack(own)]) * total


class _FormFactor(NamedTuple):
    """Factors of one form along a motion."""

    function: Callable[..., tuple[Any, Any, Any]]
    """Displacement and velocity (N,), then the form's parameters -> three factors (N,)."""
    values: tuple[float, ...]

    def evaluate(self, x: Array, v: Array) -> Array:
        """Return the factors (3, N)."""
        return np.stack([np.broadcast_to(f, x.shape) for f in self.function(x, v, *self.values)])

    def differentiate_by_motion(self, motion: DamperMotion) -> Array:
        """Return the derivatives (M, 3, N) of the factors over the unknowns of the motion."""
        over_x = differentiate_by_argument(lambda x: self.evaluate(x, motion.v), motion.x, _DISPLACEMENT_STEP)
        over_v = differentiate_by_argument(lambda v: self.evaluate(motion.x, v), motion.v, _VELOCITY_STEP)
        return np.asarray(over_x * motion.dx[:, None, :] + over_v * motion.dv[:, None, :])


def _bind_form(
    form: Form, values: tuple[float, ...], variables: DamperVariables, excitation: Excitation, *, half: bool
) -> _FormFactor:
    """Return the factors of a form over the motion, at the samples or half way between."""
    if form.action == "gain_function":
        return _FormFactor(partial(_evaluate_gain, form, variables), values)
    if form.action == "scaling":
        return _FormFactor(form.function, values)
    return _FormFactor(partial(_soften, form, excitation, half), values)


def _soften(form: Form, excitation: Excitation, half: bool, x: Array, v: Array, *own: Any) -> tuple[Any, Any, Any]:
    """Return the factors of a fluid that dissipated energy heats, at the samples or half way between."""

    def store(recovery: float) -> Array:
        energy = compute_stored_energy(excitation, recovery)
        return 0.5 * (energy[1:] + energy[:-1]) if half else energy

    recovery = form.name_values(own)["recovery_time"]
    factors: tuple[Any, Any, Any] = form.function(evaluate_by_differences(store, recovery), *own)
    return factors


def _evaluate_gain(form: Form, samples: DamperVariables, x: Array, v: Array, *own: Any) -> tuple[Any, Any, Any]:
    """Return the factors of a defined effect at a motion near that of the samples."""
    gain = 1.0 + form.function(MovedVariables(samples, x, v), *own)
    return gain, gain, gain
