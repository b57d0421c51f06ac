"""The motion of the damper behind a recorded displacement: delays, the channel's bend, play in the mounting."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, compiled, compiled_anew
from identification.damper.effects import Form
from identification.simulate.curves import over_parameters
from identification.simulate.setting import Setting, Stroke
from identification.simulate.step import between

_STEP, _WIDE = 1e-6, 1e-5
"""[m] of first and second differences of a channel's bend."""
_CONTACT = 1e-8
"""[m] of differences of a follower: it is straight on both sides of its corners."""
_INVERSIONS = 3


class Motion(NamedTuple):
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


def damper_motion(setting: Setting, stroke: Stroke, slopes: bool = True) -> Motion:
    """Motion of the damper, with derivatives over the force channel's delay first; on request without others."""
    late = sum(values[0] for _, _, values in setting.acting("time_shift"))
    early = sum(values[0] for _, _, values in setting.acting("displacement_shift"))
    motion = _delayed(stroke, setting.force_delay + late - early)
    # A displacement that is late shows the force's motion early: the delay's slopes with the other sign.
    for at, _, _ in setting.acting("displacement_shift"):
        motion = _with_rows(motion, -motion.dx[:1], -motion.dv[:1], (at,))
    for at, form, values in setting.acting("displacement_map"):
        motion = _straightened(motion, form, values, at, slopes)
    for at, form, values in setting.acting("displacement_follower"):
        followed = _follow(machine(form.act), motion.x, motion.v, motion.dx, motion.dv, values[0])
        motion = Motion(*followed[:2], motion.a, *followed[2:], motion.da, (*motion.columns, at))
    return motion


def _with_rows(motion: Motion, dx: Array, dv: Array, columns: tuple[int, ...]) -> Motion:
    return motion._replace(
        dx=np.vstack([motion.dx, dx]), dv=np.vstack([motion.dv, dv]), columns=(*motion.columns, *columns)
    )


def _delayed(stroke: Stroke, delay: float) -> Motion:
    """Motion ``delay`` [s] ago, by Hermite cubics, and its derivative over the delay."""
    x, v, a = stroke.displacement, stroke.velocity, stroke.acceleration
    h = 1.0 / stroke.rate
    if delay == 0.0:
        return Motion(x, v, a, -v[None, :], -a[None, :], -np.gradient(a, h), ())
    shifted, speed, pushed, dx, dv, da = _earlier(x, v, a, delay / h, h)
    return Motion(shifted, speed, pushed, dx[None, :], dv[None, :], da, ())


@compiled
def _earlier(x: Array, v: Array, a: Array, samples: float, h: float) -> tuple[Array, ...]:
    """Displacement, velocity and acceleration (N,) some samples ago, and their derivatives over that time [s].

    Before the first sample and behind the last the motion stands still.
    """
    count = len(x)
    found = np.empty((6, count))
    for k in range(count):
        place = min(max(k - samples, 0.0), count - 1.0)
        i = min(int(place), count - 2)
        t = place - i
        found[0, k], x_slope = between(x[i], x[i + 1], v[i], v[i + 1], h, t)
        found[1, k], v_slope = between(v[i], v[i + 1], a[i], a[i + 1], h, t)
        jerk = (a[i + 1] - a[i]) / h
        found[2, k] = a[i] + t * h * jerk
        inside = 0.0 < place < count - 1.0
        found[3, k], found[4, k], found[5, k] = (-x_slope, -v_slope, -jerk) if inside else (0.0, 0.0, 0.0)
    return found[0], found[1], found[2], found[3], found[4], found[5]


def _straightened(motion: Motion, form: Form, values: tuple[float, ...], at: int, slopes: bool) -> Motion:
    """The true motion behind a channel that is bent: x + bend(x) was recorded."""
    x = motion.x
    for _ in range(_INVERSIONS):
        x = x - (x + form.act(x, *values) - motion.x) / _gain(form.act, x, values)
    gain = _gain(form.act, x, values)
    moved = motion._replace(x=x, v=motion.v / gain)
    if not slopes:
        return moved
    bend = (form.act(x + _WIDE, *values) + form.act(x - _WIDE, *values) - 2.0 * form.act(x, *values)) / _WIDE**2
    over_v = -motion.v * bend / gain**3
    moved = moved._replace(dx=motion.dx / gain, dv=motion.dv / gain + motion.dx * over_v)
    shifts = over_parameters(lambda *p: form.act(x, *p), values, form.parameters)
    gains = over_parameters(lambda *p: _gain(form.act, x, p), values, form.parameters)
    dx = -np.stack(shifts) / gain
    dv = -motion.v / gain**2 * (np.stack(gains) + bend * dx)
    return _with_rows(moved, dx, dv, tuple(range(at, at + len(values))))


def _gain(bend: Callable[..., Any], x: Array, values: tuple[float, ...]) -> Array:
    """Gain [1] of the channel at x."""
    steepness = (bend(x + _STEP, *values) - bend(x - _STEP, *values)) / (2.0 * _STEP)
    # A channel that stands still or runs backwards has no inverse; on the way a search may ask for one.
    return np.asarray(np.maximum(1.0 + steepness, 0.1))


_MACHINE: dict[Any, Any] = {}


def machine(function: Any) -> Any:
    """The compiled form of a scalar function, made once."""
    # Once each: a new object would be a new type to whatever takes it, which would be compiled again, too.
    if function not in _MACHINE:
        _MACHINE[function] = compiled(function)
    return _MACHINE[function]


@compiled_anew
def _follow(act: Any, x: Array, v: Array, dx: Array, dv: Array, value: float) -> tuple[Array, Array, Array, Array]:
    """Run a follower of one parameter along a motion; its derivative becomes the last row."""
    count, extra, e = len(x), len(dx), _CONTACT
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
