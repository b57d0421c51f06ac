"""Factors on alpha, c0 and c1 along an excitation from effects that scale the law, and their derivatives."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.simulate.curves import (
    differentiate_by_argument,
    differentiate_by_parameters,
    interpolate_midpoints,
)
from identification.simulate.motion import DamperMotion
from identification.simulate.simulation_model import Excitation, SimulationModel

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
    scaling = model.select_forms("scaling", "softening")
    if not scaling:
        return ScaleFactors(np.ones((3, 0)), np.ones((3, 0)), np.ones((0, 3, 0)), np.ones((0, 3, 0)), ())
    h = 1.0 / excitation.rate
    x, v = interpolate_midpoints(motion.x, motion.v, h)
    dx, dv = interpolate_midpoints(motion.dx, motion.dv, h)
    # No scaling effect depends on the acceleration. x fills its two places.
    middle = DamperMotion(x, v, x, dx, dv, x, motion.columns)
    columns = tuple(at + k for at, _, values in scaling for k in range(len(values)))
    at, over = _multiply_factors(scaling, motion, excitation, half=False, sensitivities=sensitivities)
    at_middle, over_middle = _multiply_factors(scaling, middle, excitation, half=True, sensitivities=sensitivities)
    return ScaleFactors(at, at_middle, over, over_middle, columns)


def _multiply_factors(
    scaling: Any, motion: DamperMotion, excitation: Excitation, *, half: bool, sensitivities: bool
) -> tuple[Array, Array]:
    """Return the product of all factors (3, N) and its derivatives (S, 3, N)."""
    parts = [_bind_form(form, values, motion, excitation, half) for _, form, values in scaling]
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
    form: Any, values: tuple[float, ...], motion: DamperMotion, excitation: Excitation, half: bool
) -> _FormFactor:
    if form.action == "scaling":
        return _FormFactor(lambda x, v, *own: np.stack(form.function(x, v, *own)), values, form.parameters)
    recovery = [q.symbol for q in form.parameters].index("recovery_time")

    def warmed(x: Array, v: Array, *own: float) -> Array:
        energy = compute_stored_energy(excitation, own[recovery])
        energy = 0.5 * (energy[1:] + energy[:-1]) if half else energy
        return np.stack(form.function(energy, *own))

    return _FormFactor(warmed, values, form.parameters)


def compute_stored_energy(excitation: Excitation, recovery: float) -> Array:
    """Compute the energy (N,) [J] that the damper has dissipated and not yet lost.

    Args:
        excitation: excitation with the dissipated power.
        recovery: time constant with which the energy leaves [s].
    """
    if excitation.power is None:
        return np.zeros(len(excitation.displacement))
    h = 1.0 / excitation.rate
    fade = np.exp(-h / recovery)
    # Exact for a power that is constant over a sample. expm1, because a recovery takes many samples.
    gain = -recovery * np.expm1(-h / recovery)
    power = np.concatenate([[0.0], 0.5 * (excitation.power[1:] + excitation.power[:-1])])
    return np.asarray(signal.lfilter([gain], [1.0, -fade], power))
