"""The whole chain from a recording's inputs to its force, with exact slopes where asked.

displacement, drive -> [force channel's delay] -> [mounting] -> law, forces beside it -> force. A force channel
that lags by tau shows the force of inputs tau earlier, so the delay is applied to the smooth inputs and never
to the force, whose corners no interpolation would keep.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, compiled
from identification.damper.coordinates import COORDINATES, Coordinates
from identification.damper.effects import Effect
from identification.simulate import inputs
from identification.simulate.kernel import Plan, march, march_with_slopes
from identification.simulate.step import STRUCTURAL

FINENESS = 0.1
"""[1] travel of zeta above which a sample takes more steps: 4e-5 of the force's deviation at most."""

UNKNOWNS: tuple[str, ...] = (*(q.symbol for q in COORDINATES), "y0", "force_delay", "drive_delay")
"""Columns of the slopes; parameters of effects follow as ``effect.parameter``."""

_STRUCTURAL_COLUMNS = [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
_ETA, _C1_A, _C1_B, _K1, _F0, _Y0, _FORCE_DELAY, _DRIVE_DELAY = 5, 8, 9, 11, 12, 13, 14, 15


@dataclass(frozen=True)
class Stroke:
    """What acts on the damper, sampled at one rate."""

    rate: float
    """[Hz]"""
    displacement: Array
    """(N,) at the actuator [m], smooth: noise in it becomes force."""
    velocity: Array
    """(N,) its derivative [m/s]."""
    acceleration: Array
    """(N,) its second derivative [m/s^2]."""
    drive: Array
    """(N,) held between samples [V or A]."""

    def finer(self, times: int) -> "Stroke":
        """The same stroke at ``times`` the rate: (N - 1) times + 1 samples."""
        if times == 1:
            return self
        place = np.arange((len(self.drive) - 1) * times + 1) / times
        i = np.minimum(place.astype(np.int64), len(self.drive) - 2)
        t, h = place - i, 1.0 / self.rate
        x, _ = _hermite(self.displacement, self.velocity, i, t, h)
        v, a = _hermite(self.velocity, self.acceleration, i, t, h)
        return Stroke(self.rate * times, x, v, a, np.repeat(self.drive, times)[: len(place)])


class ActiveEffect(NamedTuple):
    """An effect with values for its parameters."""

    effect: Effect
    values: tuple[float, ...]


@dataclass(frozen=True)
class Setting:
    """Everything that a trajectory depends on beside its inputs."""

    coordinates: Coordinates
    y0: float = 0.0
    """[m] inner displacement at the first sample."""
    force_delay: float = 0.0
    """[s] lag of the force channel behind the displacement channel."""
    drive_delay: float = 0.0
    """[s] lag of the force channel behind the drive channel, in addition."""
    effects: tuple[ActiveEffect, ...] = ()


@dataclass(frozen=True)
class Trajectory:
    """What the model answers."""

    force: Array
    """(N,) [N]"""
    y: Array
    """(N,) inner displacement [m]."""
    zeta: Array
    """(N,) hysteretic state over its saturation [1]."""
    field: Array
    """(N,) field behind the drive [V or A]."""
    plan: Plan
    """(N-1,) steps taken in each sample; hand it back to keep later trajectories smooth in their unknowns."""
    slopes: Array = default(default_factory=lambda: np.empty((0, 0)))
    """(N, unknowns) derivative of the force over each of ``columns``; empty unless asked for."""
    columns: tuple[str, ...] = ()


class _Motion(NamedTuple):
    """Displacement and velocity of the damper, and their derivatives over E unknowns."""

    x: Array
    v: Array
    dx: Array
    """(E, N)"""
    dv: Array


def simulate(
    setting: Setting,
    stroke: Stroke,
    plan: Plan | None = None,
    *,
    slopes: bool = False,
    fineness: float = FINENESS,
) -> Trajectory:
    """Force of the damper along a recording, and its slopes over every unknown if asked.

    Args:
        setting: coordinates, delays, effects.
        stroke: the inputs.
        plan: steps per sample of an earlier trajectory; chosen anew if None.
        slopes: also the derivatives; costs some two and a half plain simulations.
        fineness: travel of the hysteretic state above which a sample takes more than one step [1].
    """
    c, h = setting.coordinates, 1.0 / stroke.rate
    moved = _mounting(setting.effects, _delayed(stroke, setting.force_delay + _shift(setting.effects)))
    u, middle, du, dmiddle = inputs.field(
        stroke.drive, c.eta, setting.force_delay + setting.drive_delay + _shift(setting.effects), h
    )
    s = np.array([c[i] for i in _STRUCTURAL_COLUMNS])
    plan = np.zeros(len(u) - 1, np.uint8) if plan is None else plan
    zeta0 = inputs.settled_hysteresis(moved.v[0])
    c1 = c.c1_a + c.c1_b * u
    if slopes:
        rows = 2 + len(moved.dx)
        y, zeta, y_rate, partial = march_with_slopes(
            s,
            c1,
            moved.x,
            moved.v,
            u,
            middle,
            h,
            setting.y0,
            zeta0,
            fineness,
            plan,
            moved.dx,
            moved.dv,
            _also_for_force_delay(du, rows),
            _also_for_force_delay(dmiddle, rows),
        )
    else:
        y, zeta, y_rate = march(s, moved.x, moved.v, u, middle, h, setting.y0, zeta0, fineness, plan)
    force = c1 * y_rate + c.k1 * moved.x - c.f0
    for effect, values in setting.effects:
        if effect.acts == "parallel_force":
            force += effect.act(moved.x, moved.v, *values)
    found = Trajectory(force, y, zeta, u, plan)
    return _with_slopes(found, setting, moved, partial) if slopes else found


def _also_for_force_delay(derivative: Array, rows: int) -> Array:
    """Rows for eta, drive delay, force delay (which delays the drive too), and zeros for what leaves it alone."""
    wide = np.zeros((rows, derivative.shape[1]))
    wide[:2], wide[2] = derivative, derivative[1]
    return wide


def _with_slopes(found: Trajectory, setting: Setting, moved: _Motion, partial: Array) -> Trajectory:
    """The trajectory with its slopes laid out as ``UNKNOWNS`` and the parameters of the effects."""
    names = [f"{e.effect.name}.{q.symbol}" for e in setting.effects for q in e.effect.parameters]
    J = np.zeros((len(found.force), len(UNKNOWNS) + len(names)))
    J[:, _STRUCTURAL_COLUMNS] = partial[:, :STRUCTURAL]
    J[:, _Y0] = partial[:, STRUCTURAL]
    J[:, _ETA] = partial[:, STRUCTURAL + 1]
    J[:, _DRIVE_DELAY] = partial[:, STRUCTURAL + 2]
    J[:, _K1] = moved.x
    J[:, _F0] = -1.0
    places = _places(setting.effects)
    moving = [_FORCE_DELAY, *(at for at, e in places if e.effect.acts == "displacement_follower")]
    for e, column in enumerate(moving):
        J[:, column] = partial[:, STRUCTURAL + 3 + e] + setting.coordinates.k1 * moved.dx[e]
    for at, (effect, values) in places:
        if effect.acts == "parallel_force":
            over_x, over_v, *over = effect.slopes(moved.x, moved.v, *values)
            J[:, at : at + len(values)] = np.column_stack(over)
            J[:, moving] += over_x[:, None] * moved.dx.T + over_v[:, None] * moved.dv.T
    for at, (effect, _) in places:
        if effect.acts == "time_shift":
            J[:, at] = J[:, _FORCE_DELAY]
    return replace(found, slopes=J, columns=(*UNKNOWNS, *names))


def _places(effects: Sequence[ActiveEffect]) -> list[tuple[int, ActiveEffect]]:
    """Each effect with the column of its first parameter."""
    starts = np.cumsum([len(UNKNOWNS), *(len(e.values) for e in effects)])
    return [(int(start), e) for start, e in zip(starts, effects, strict=False)]


def _shift(effects: Sequence[ActiveEffect]) -> float:
    """Lag [s] of the force channel that the effects add."""
    return sum(-float(e.effect.act(0.0, *e.values)) for e in effects if e.effect.acts == "time_shift")


def _delayed(stroke: Stroke, delay: float) -> _Motion:
    """Motion ``delay`` [s] ago, by Hermite cubics, and its derivative over the delay."""
    x, v, a = stroke.displacement, stroke.velocity, stroke.acceleration
    if delay == 0.0:
        return _Motion(x, v, -v[None, :], -a[None, :])
    h, count = 1.0 / stroke.rate, len(x)
    place = np.clip(np.arange(count) - delay / h, 0.0, count - 1.0)
    i = np.minimum(place.astype(np.int64), count - 2)
    inside = (place > 0.0) & (place < count - 1.0)
    shifted, x_slope = _hermite(x, v, i, place - i, h)
    speed, v_slope = _hermite(v, a, i, place - i, h)
    return _Motion(
        shifted, speed, np.where(inside, -x_slope, 0.0)[None, :], np.where(inside, -v_slope, 0.0)[None, :]
    )


def _hermite(value: Array, slope: Array, i: Any, t: Array, h: float) -> tuple[Array, Array]:
    """Value and its derivative at the fraction t of sample i, from values and slopes at the samples."""
    d = value[i + 1] - value[i]
    square = 3.0 * d - h * (2.0 * slope[i] + slope[i + 1])
    cube = h * (slope[i] + slope[i + 1]) - 2.0 * d
    return (
        value[i] + t * (h * slope[i] + t * (square + t * cube)),
        slope[i] + t * (2.0 * square + 3.0 * t * cube) / h,
    )


def _mounting(effects: Sequence[ActiveEffect], motion: _Motion) -> _Motion:
    """Motion of the damper behind whatever holds its displacement back."""
    for effect, values in effects:
        if effect.acts == "displacement_follower":
            motion = _Motion(*_follow(_machine(effect.act), _machine(effect.slopes), *motion, values[0]))
    return motion


_MACHINE: dict[Any, Any] = {}


def _machine(function: Any) -> Any:
    """The compiled form of a scalar function, made once."""
    if function not in _MACHINE:
        _MACHINE[function] = compiled(function)
    return _MACHINE[function]


@compiled
def _follow(
    act: Any, slopes: Any, x: Array, v: Array, dx: Array, dv: Array, value: float
) -> tuple[Array, Array, Array, Array]:
    """Run a follower of one parameter along a motion; its derivative becomes the last row."""
    count, extra = len(x), len(dx)
    out, speed = np.empty(count), np.empty(count)
    dout, dspeed = np.zeros((extra + 1, count)), np.zeros((extra + 1, count))
    held = x[0]
    for i in range(count):
        over_held, over_x, over_value = slopes(held, x[i], value)
        held = act(held, x[i], value)
        out[i], speed[i] = held, over_x * v[i]
        for e in range(extra + 1):
            before = dout[e, i - 1] if i > 0 else 0.0
            dout[e, i] = over_held * before + (over_x * dx[e, i] if e < extra else over_value)
            dspeed[e, i] = over_x * dv[e, i] if e < extra else 0.0
    return out, speed, dout, dspeed
