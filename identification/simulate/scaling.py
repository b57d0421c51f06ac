"""Factors of alpha, c0 and c1 along a stroke, of the effects that scale the law, and their derivatives."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.simulate.curves import half_way, over_number, over_parameters
from identification.simulate.motion import Motion
from identification.simulate.setting import Setting, Stroke

_DISPLACEMENT_STEP, _VELOCITY_STEP = 1e-7, 1e-6
"""[m], [m/s] of differences."""


class Factors(NamedTuple):
    """Factors [1] of alpha, c0 and c1, and their derivatives over the motion's unknowns and their own."""

    at: Array
    """(3, N); (3, 0) where nothing scales."""
    middle: Array
    """(3, N-1)"""
    over: Array
    """(S, 3, N)"""
    over_middle: Array
    """(S, 3, N-1)"""
    columns: tuple[int, ...]
    """Columns of the unknowns behind those of the motion, among the parameters of the effects."""


def factors(setting: Setting, stroke: Stroke, motion: Motion, slopes: bool = True) -> Factors:
    """Factors of everything that scales, at the samples and half way between; derivatives only on request."""
    scaling = setting.acting("scaling", "softening")
    if not scaling:
        return Factors(np.ones((3, 0)), np.ones((3, 0)), np.ones((0, 3, 0)), np.ones((0, 3, 0)), ())
    h = 1.0 / stroke.rate
    x, v = half_way(motion.x, motion.v, h)
    dx, dv = half_way(motion.dx, motion.dv, h)
    # Nothing that scales asks for an acceleration: x fills its two places.
    middle = Motion(x, v, x, dx, dv, x, motion.columns)
    columns = tuple(at + k for at, _, values in scaling for k in range(len(values)))
    at, over = _product(scaling, motion, stroke, half=False, slopes=slopes)
    at_middle, over_middle = _product(scaling, middle, stroke, half=True, slopes=slopes)
    return Factors(at, at_middle, over, over_middle, columns)


def _product(scaling: Any, motion: Motion, stroke: Stroke, *, half: bool, slopes: bool) -> tuple[Array, Array]:
    """The product of all factors (3, N) and its derivatives (S, 3, N)."""
    parts = [_bound(form, values, motion, stroke, half) for _, form, values in scaling]
    total = np.prod([part.act(motion.x, motion.v, *part.values) for part in parts], axis=0)
    if not slopes:
        return total, np.ones((0, 3, 0))
    relative = np.zeros((len(motion.dx), 3, len(motion.x)))
    own = []
    for part in parts:
        alone = part.act(motion.x, motion.v, *part.values)
        relative += part.over_motion(motion) / alone
        rows = over_parameters(partial(part.act, motion.x, motion.v), part.values, part.quantities)
        own += [row / alone for row in rows]
    return total, np.concatenate([relative, np.stack(own)]) * total


class _Part(NamedTuple):
    """One form over displacement and velocity."""

    act: Callable[..., Array]
    values: tuple[float, ...]
    quantities: Any

    def over_motion(self, motion: Motion) -> Array:
        """Derivatives (M, 3, N) of the factors over the motion's unknowns."""

        def at_displacement(x: Array) -> Array:
            return self.act(x, motion.v, *self.values)

        def at_velocity(v: Array) -> Array:
            return self.act(motion.x, v, *self.values)

        over_x = over_number(at_displacement, motion.x, _DISPLACEMENT_STEP)
        over_v = over_number(at_velocity, motion.v, _VELOCITY_STEP)
        return np.asarray(over_x * motion.dx[:, None, :] + over_v * motion.dv[:, None, :])


def _bound(form: Any, values: tuple[float, ...], motion: Motion, stroke: Stroke, half: bool) -> _Part:
    if form.acts == "scaling":
        return _Part(lambda x, v, *own: np.stack(form.act(x, v, *own)), values, form.parameters)
    recovery = [q.symbol for q in form.parameters].index("recovery")

    def warmed(x: Array, v: Array, *own: float) -> Array:
        energy = stored_energy(stroke, own[recovery])
        energy = 0.5 * (energy[1:] + energy[:-1]) if half else energy
        return np.stack(form.act(energy, *own))

    return _Part(warmed, values, form.parameters)


def stored_energy(stroke: Stroke, recovery: float) -> Array:
    """(N,) energy [J] that the damper has dissipated and not yet given away with a time constant [s]."""
    if stroke.power is None:
        return np.zeros(len(stroke.displacement))
    h = 1.0 / stroke.rate
    fade = np.exp(-h / recovery)
    # Exact for a power that is constant over a sample; expm1, since a recovery takes many samples.
    gain = -recovery * np.expm1(-h / recovery)
    power = np.concatenate([[0.0], 0.5 * (stroke.power[1:] + stroke.power[:-1])])
    return np.asarray(signal.lfilter([gain], [1.0, -fade], power))
