"""The motion of the damper behind a recorded displacement: delays, the channel's bend, play in the mounting."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, njit_cached, njit_uncached
from identification.damper.effects import Form
from identification.simulate.curves import differentiate_by_parameters
from identification.simulate.simulation_model import Excitation, SimulationModel
from identification.simulate.step import interpolate_motion

_FIRST_STEP, _SECOND_STEP = 1e-6, 1e-5
"""[m] of first and second differences of a channel's bend."""
_CONTACT_STEP = 1e-8
"""[m] of differences of a follower: it is straight on both sides of its corners."""
_INVERSION_STEPS = 3


class DamperMotion(NamedTuple):
    """Displacement and velocity, (N,) each, and their derivatives over M unknowns."""

    x: Array
    """[m]"""
    v: Array
    """[m/s]"""
    a: Array
    """[m/s^2] of the actuator, whatever the mounting does."""
    dx: Array
    """(M, N)"""
    dv: Array
    """(M, N)"""
    da: Array
    """(N,) derivative of the acceleration over the delay."""
    columns: tuple[int, ...]
    """Columns of the unknowns behind the first, which is the delay, among the parameters of the effects."""


def compute_damper_motion(
    setting: SimulationModel, stroke: Excitation, sensitivities: bool = True
) -> DamperMotion:
    """Motion of the damper, with derivatives over the force channel's delay first; on request without others."""
    late = sum(values[0] for _, _, values in setting.select_forms("time_shift"))
    early = sum(values[0] for _, _, values in setting.select_forms("displacement_shift"))
    motion = _delay_motion(stroke, setting.force_delay + late - early)
    # A displacement that is late shows the force's motion early: the delay's sensitivities with the other sign.
    for at, _, _ in setting.select_forms("displacement_shift"):
        motion = _append_rows(motion, -motion.dx[:1], -motion.dv[:1], (at,))
    for at, form, values in setting.select_forms("displacement_map"):
        motion = _invert_channel(motion, form, values, at, sensitivities)
    for at, form, values in setting.select_forms("displacement_backlash"):
        followed = _apply_backlash(
            compile_once(form.function), motion.x, motion.v, motion.dx, motion.dv, values[0]
        )
        motion = DamperMotion(*followed[:2], motion.a, *followed[2:], motion.da, (*motion.columns, at))
    return motion


def _append_rows(motion: DamperMotion, dx: Array, dv: Array, columns: tuple[int, ...]) -> DamperMotion:
    return motion._replace(
        dx=np.vstack([motion.dx, dx]), dv=np.vstack([motion.dv, dv]), columns=(*motion.columns, *columns)
    )


def _delay_motion(stroke: Excitation, delay: float) -> DamperMotion:
    """Motion ``delay`` [s] ago, by Hermite cubics, and its derivative over the delay."""
    x, v, a = stroke.displacement, stroke.velocity, stroke.acceleration
    h = 1.0 / stroke.rate
    if delay == 0.0:
        return DamperMotion(x, v, a, -v[None, :], -a[None, :], -np.gradient(a, h), ())
    shifted, speed, pushed, dx, dv, da = _interpolate_earlier(x, v, a, delay / h, h)
    return DamperMotion(shifted, speed, pushed, dx[None, :], dv[None, :], da, ())


@njit_cached
def _interpolate_earlier(x: Array, v: Array, a: Array, samples: float, h: float) -> tuple[Array, ...]:
    """Displacement, velocity and acceleration (N,) some samples ago, and their derivatives over that time [s].

    Before the first sample and behind the last the motion stands still.
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
    """The true motion behind a channel that is bent: x + bend(x) was recorded."""
    x = motion.x
    for _ in range(_INVERSION_STEPS):
        x = x - (x + form.function(x, *values) - motion.x) / _compute_gain(form.function, x, values)
    gain = _compute_gain(form.function, x, values)
    moved = motion._replace(x=x, v=motion.v / gain)
    if not sensitivities:
        return moved
    bend = (
        form.function(x + _SECOND_STEP, *values)
        + form.function(x - _SECOND_STEP, *values)
        - 2.0 * form.function(x, *values)
    ) / _SECOND_STEP**2
    over_v = -motion.v * bend / gain**3
    moved = moved._replace(dx=motion.dx / gain, dv=motion.dv / gain + motion.dx * over_v)
    shifts = differentiate_by_parameters(lambda *p: form.function(x, *p), values, form.parameters)
    gains = differentiate_by_parameters(lambda *p: _compute_gain(form.function, x, p), values, form.parameters)
    dx = -np.stack(shifts) / gain
    dv = -motion.v / gain**2 * (np.stack(gains) + bend * dx)
    return _append_rows(moved, dx, dv, tuple(range(at, at + len(values))))


def _compute_gain(bend: Callable[..., Any], x: Array, values: tuple[float, ...]) -> Array:
    """Gain [1] of the channel at x."""
    steepness = (bend(x + _FIRST_STEP, *values) - bend(x - _FIRST_STEP, *values)) / (2.0 * _FIRST_STEP)
    # A channel that stands still or runs backwards has no inverse; on the way a search may ask for one.
    return np.asarray(np.maximum(1.0 + steepness, 0.1))


_COMPILED: dict[Any, Any] = {}


def compile_once(function: Any) -> Any:
    """The compiled form of a scalar function, made once."""
    # Once each: a new object would be a new type to whatever takes it, which would be compiled again, too.
    if function not in _COMPILED:
        _COMPILED[function] = njit_cached(function)
    return _COMPILED[function]


@njit_uncached
def _apply_backlash(
    act: Any, x: Array, v: Array, dx: Array, dv: Array, value: float
) -> tuple[Array, Array, Array, Array]:
    """Run a follower of one parameter along a motion; its derivative becomes the last row."""
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
