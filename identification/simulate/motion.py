"""Motion of the damper from the recorded displacement: delays, nonlinearity of the channel, backlash."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, njit_cached, njit_uncached
from identification.damper.effects import Form
from identification.simulate.curves import differentiate_by_parameters
from identification.simulate.dual import differentiate
from identification.simulate.simulation_model import Excitation, SimulationModel
from identification.simulate.step import interpolate_motion

_FIRST_STEP, _SECOND_STEP = 1e-6, 1e-5
"""Steps of first and second differences of a channel's error [m]."""
_CONTACT_STEP = 1e-8
"""Step of differences of backlash [m]; backlash is linear on both sides of its corners."""
_INVERSION_STEPS = 3
"""Number of Newton steps in which the displacement channel is inverted."""


class DamperMotion(NamedTuple):
    """Motion of the damper, (N,) each, and its derivatives over M unknowns."""

    x: Array
    """Displacement [m]."""
    v: Array
    """Velocity [m/s]."""
    a: Array
    """Acceleration of the actuator [m/s^2], without effects of the mounting."""
    dx: Array
    """(M, N) derivatives of the displacement."""
    dv: Array
    """(M, N) derivatives of the velocity."""
    da: Array
    """(N,) derivative of the acceleration over the force delay."""
    columns: tuple[int, ...]
    """Columns of all unknowns but the first, among the parameters of the effects; the first is the force delay."""


def compute_damper_motion(
    model: SimulationModel, excitation: Excitation, sensitivities: bool = True
) -> DamperMotion:
    """Compute the motion of the damper and its derivatives.

    Those over the force delay come first and are always computed; the others only with ``sensitivities``.
    """
    late = sum(values[0] for _, _, values in model.select_forms("time_shift"))
    early = sum(values[0] for _, _, values in model.select_forms("displacement_shift"))
    motion = _delay_motion(excitation, model.force_delay + late - early)
    # A delay of the displacement acts as a negative delay of the force.
    for at, _, _ in model.select_forms("displacement_shift"):
        motion = _append_rows(motion, -motion.dx[:1], -motion.dv[:1], (at,))
    for at, form, values in model.select_forms("displacement_map"):
        motion = _invert_channel(motion, form, values, at, sensitivities)
    for at, form, values in model.select_forms("displacement_function"):
        motion = _invert_defined_channel(motion, form, values, at, excitation)
    for at, form, values in model.select_forms("displacement_backlash"):
        motion = _follow_with_backlash(motion, form, values, at)
    return motion


def _append_rows(motion: DamperMotion, dx: Array, dv: Array, columns: tuple[int, ...]) -> DamperMotion:
    return motion._replace(
        dx=np.vstack([motion.dx, dx]), dv=np.vstack([motion.dv, dv]), columns=(*motion.columns, *columns)
    )


def _delay_motion(excitation: Excitation, delay: float) -> DamperMotion:
    """Return the motion ``delay`` [s] earlier, by Hermite cubics, and its derivatives over the delay."""
    x, v, a = excitation.displacement, excitation.velocity, excitation.acceleration
    h = 1.0 / excitation.rate
    if delay == 0.0:
        return DamperMotion(x, v, a, -v[None, :], -a[None, :], -np.gradient(a, h), ())
    shifted, speed, pushed, dx, dv, da = _interpolate_earlier(x, v, a, delay / h, h)
    return DamperMotion(shifted, speed, pushed, dx[None, :], dv[None, :], da, ())


@njit_cached
def _interpolate_earlier(x: Array, v: Array, a: Array, samples: float, h: float) -> tuple[Array, ...]:
    """Return displacement, velocity and acceleration (N,) some samples earlier, and their derivatives over time.

    The motion is constant before the first and after the last sample.
    """
    count = len(x)
    found = np.empty((6, count))
    for k in range(count):
        place = min(max(k - samples, 0.0), count - 1.0)
        i = min(int(place), count - 2)
        t = place - i
        found[0, k], x_slope = interpolate_motion(x[i], x[i + 1], v[i], v[i + 1], h, t)
        found[1, k], v_slope = interpolate_motion(v[i], v[i + 1], a[i], a[i + 1], h, t)
        jerk = (a[i + 1] - a[i]) / h
        found[2, k] = a[i] + t * h * jerk
        inside = 0.0 < place < count - 1.0
        found[3, k], found[4, k], found[5, k] = (-x_slope, -v_slope, -jerk) if inside else (0.0, 0.0, 0.0)
    return found[0], found[1], found[2], found[3], found[4], found[5]


def _invert_channel(
    motion: DamperMotion, form: Form, values: tuple[float, ...], at: int, sensitivities: bool
) -> DamperMotion:
    """Return the true motion x behind a nonlinear channel, which recorded x + error(x)."""
    x = motion.x
    for _ in range(_INVERSION_STEPS):
        x = x - (x + form.function(x, *values) - motion.x) / _compute_gain(form.function, x, values)
    gain = _compute_gain(form.function, x, values)
    moved = motion._replace(x=x, v=motion.v / gain)
    if not sensitivities:
        return moved
    bend = _compute_bend(form.function, x, values)
    over_v = -motion.v * bend / gain**3
    moved = moved._replace(dx=motion.dx / gain, dv=motion.dv / gain + motion.dx * over_v)
    behind, here, ahead = (
        np.stack(differentiate(partial(form.function, x + step), values)[1])
        for step in (-_FIRST_STEP, 0.0, _FIRST_STEP)
    )
    dx = -here / gain
    dv = -motion.v / gain**2 * ((ahead - behind) / (2.0 * _FIRST_STEP) + bend * dx)
    return _append_rows(moved, dx, dv, tuple(range(at, at + len(values))))


def _invert_defined_channel(
    motion: DamperMotion, form: Form, values: tuple[float, ...], at: int, excitation: Excitation
) -> DamperMotion:
    """Return the true motion behind a channel with a defined effect, which recorded x + error(x, v, time)."""

    def invert(x: Array, v: Array, *own: float) -> Array:
        return _find_true_motion(form, excitation, x, v, *own)

    x, v = invert(motion.x, motion.v, *values)
    step = _FIRST_STEP / max(float(np.abs(motion.dx).max(initial=0.0)), _FIRST_STEP)
    moved = [
        (invert(motion.x + step * dx, motion.v + step * dv, *values) - [x, v]) / step
        for dx, dv in zip(motion.dx, motion.dv, strict=True)
    ]
    own = np.stack(differentiate_by_parameters(partial(invert, motion.x, motion.v), values, form.parameters))
    dx, dv = np.stack(moved).swapaxes(0, 1)
    columns = tuple(range(at, at + len(values)))
    return _append_rows(motion._replace(x=x, v=v, dx=dx, dv=dv), own[:, 0], own[:, 1], columns)


def _find_true_motion(form: Form, excitation: Excitation, x: Array, v: Array, *own: float) -> Array:
    """Return the true displacement [m] and velocity [m/s], (2, N), that a channel recorded as x and v (N,)."""
    true_x, true_v, h = x, v, 1.0 / excitation.rate
    for _ in range(_INVERSION_STEPS):
        error = form.function({"displacement": true_x, "velocity": true_v, "time": excitation.time}, *own)
        true_x, true_v = x - error, v - np.gradient(error, h)
    return np.stack([true_x, true_v])


def _compute_bend(error: Callable[..., Any], x: Array, values: tuple[float, ...]) -> Array:
    """Compute the second derivative [1/m] of the channel's error at displacements x (N,)."""
    ahead, back = error(x + _SECOND_STEP, *values), error(x - _SECOND_STEP, *values)
    return np.asarray((ahead + back - 2.0 * error(x, *values)) / _SECOND_STEP**2)


def _compute_gain(error: Callable[..., Any], x: Array, values: tuple[float, ...]) -> Array:
    """Compute the gain [1] of the channel at displacements x (N,)."""
    derivative = (error(x + _FIRST_STEP, *values) - error(x - _FIRST_STEP, *values)) / (2.0 * _FIRST_STEP)
    # A channel with zero or negative gain has no inverse, but a search may try one.
    return np.asarray(np.maximum(1.0 + derivative, 0.1))


def _follow_with_backlash(motion: DamperMotion, form: Form, values: tuple[float, ...], at: int) -> DamperMotion:
    """Return the motion of a damper that follows its mount with backlash."""
    x, v, dx, dv = _apply_backlash(
        compile_once(form.function), motion.x, motion.v, motion.dx, motion.dv, values[0]
    )
    return DamperMotion(x, v, motion.a, dx, dv, motion.da, (*motion.columns, at))


_COMPILED: dict[Any, Any] = {}


def compile_once(function: Any) -> Any:
    """Return the compiled form of a scalar function; compile it at the first call."""
    # Each new compiled object is a new type, for which every function that takes it would be compiled again.
    if function not in _COMPILED:
        _COMPILED[function] = njit_cached(function)
    return _COMPILED[function]


@njit_uncached
def _apply_backlash(
    act: Any, x: Array, v: Array, dx: Array, dv: Array, value: float
) -> tuple[Array, Array, Array, Array]:
    """Apply backlash of one parameter to a motion; the derivative over the parameter becomes the last row."""
    count, extra, e = len(x), len(dx), _CONTACT_STEP
    out, speed = np.empty(count), np.empty(count)
    dout, dspeed = np.zeros((extra + 1, count)), np.zeros((extra + 1, count))
    held = x[0]
    for i in range(count):
        over_held = (act(held + e, x[i], value) - act(held - e, x[i], value)) / (2.0 * e)
        over_x = (act(held, x[i] + e, value) - act(held, x[i] - e, value)) / (2.0 * e)
        over_value = (act(held, x[i], value + e) - act(held, x[i], value - e)) / (2.0 * e)
        held = act(held, x[i], value)
        out[i], speed[i] = held, over_x * v[i]
        for k in range(extra + 1):
            before = dout[k, i - 1] if i > 0 else 0.0
            dout[k, i] = over_held * before + (over_x * dx[k, i] if k < extra else over_value)
            dspeed[k, i] = over_x * dv[k, i] if k < extra else 0.0
    return out, speed, dout, dspeed
