"""The whole chain from a recording's inputs to its force, with exact slopes where asked.

displacement, drive -> [displacement channel] -> [force channel's delay] -> [mounting] -> law, forces beside it ->
[force channel] -> force. A force channel that lags by tau shows the force of inputs tau earlier, so the delay is
applied to the smooth inputs and never to the force, whose corners no interpolation would keep.

What acts on the inputs (coil, displacement channel, play) and what scales the law is computed outside the march,
which takes field, motion and factors as arrays, with their derivatives. What acts on the force needs no new march.
Only a fixture that gives way has a march of its own: the damper's displacement is one of its states.
"""

from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.simulate import channel, inputs, yielding, yielding_slopes
from identification.simulate.curves import over_parameters
from identification.simulate.kernel import Derivatives, Plan, march, march_with_slopes
from identification.simulate.motion import Motion, damper_motion
from identification.simulate.scaling import Factors, factors
from identification.simulate.setting import UNKNOWNS, Setting, Stroke, Trajectory
from identification.simulate.step import STRUCTURAL

FINENESS = 0.1
"""[1] travel of zeta above which a sample takes more steps: 4e-5 of the force's deviation at most."""

_CARRYING = yielding.FIXED - STRUCTURAL - 2
"""Numbers of a connection."""
_STRUCTURAL_COLUMNS = [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
"""Of the ten structural coordinates among ``UNKNOWNS``; the others stand in the next line."""
_ETA, _K1, _F0, _Y0, _FORCE_DELAY, _DRIVE_DELAY = 5, 11, 12, 13, 14, 15


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
    plan = np.zeros(len(stroke.displacement) - 1, np.uint8) if plan is None else plan
    motion = damper_motion(setting, stroke, slopes)
    field = inputs.damper_field(setting, stroke, slopes)
    scales = factors(setting, stroke, motion, slopes)
    chain = _Chain(setting, stroke, motion, field, scales)
    carrying = connection_of(setting)
    if carrying[0] > 0.0:
        found, J = chain.yielding(plan, carrying, fineness, slopes)
    else:
        found, J = chain.rigid(plan, fineness, slopes)
    delays = [_FORCE_DELAY, *(len(UNKNOWNS) + at for at, _, _ in setting.acting("time_shift"))]
    force = channel.recorded(setting, stroke, motion, found.force, J, len(UNKNOWNS), delays)
    if J is None:
        return replace(found, force=force)
    names = [f"{e.effect.name}.{q.symbol}" for e in setting.effects for q in e.form.parameters]
    return replace(found, force=force, slopes=J, columns=(*UNKNOWNS, *names))


def connection_of(setting: Setting) -> Array:
    """(5,) what carries the damper, as ``Form`` says of "connection"; zero where rigid."""
    # Without any the sum over no rows is zero, which is rigid.
    parts = [form.act(*values) for _, form, values in setting.acting("connection")]
    return np.asarray(np.sum(np.array(parts, float).reshape(-1, _CARRYING), axis=0))


class _Chain:
    """One stroke through one setting: its inputs as the march takes them, its answers as the fit wants them."""

    def __init__(
        self, setting: Setting, stroke: Stroke, motion: Motion, field: inputs.Field, scales: Factors
    ) -> None:
        self._setting, self._stroke = setting, stroke
        self._motion, self._field, self._scales = motion, field, scales
        self._s = np.array([setting.coordinates[i] for i in _STRUCTURAL_COLUMNS])
        self._zeta0 = inputs.settled_hysteresis(motion.v[0])
        self._h = 1.0 / stroke.rate
        self._beside = channel.beside(setting, motion, self._h)
        extra = (*field.columns, -1, *motion.columns, *scales.columns)
        self._columns = [_ETA, _DRIVE_DELAY, *(_FORCE_DELAY if at < 0 else len(UNKNOWNS) + at for at in extra)]

    def rigid(self, plan: Plan, fineness: float, slopes: bool) -> tuple[Trajectory, Array | None]:
        """Trajectory and slopes (N, U) where the damper moves with the actuator."""
        c, motion, field, scales = self._setting.coordinates, self._motion, self._field, self._scales
        c1 = c.c1_a + c.c1_b * field.u
        y0, h = self._setting.y0, self._h
        inner = (motion.x, motion.v, field.u, field.middle, scales.at, scales.middle, h, y0, self._zeta0, fineness)
        J = None
        if slopes:
            J = self._empty()
            over = Derivatives(field.du, field.dmiddle, motion.dx, motion.dv, scales.over, scales.over_middle)
            columns = np.array([*_STRUCTURAL_COLUMNS, _Y0, *self._columns])
            y, zeta, y_rate = march_with_slopes(self._s, c1, *inner, plan, over, columns, J)
            self._add_rest(J)
        else:
            y, zeta, y_rate = march(self._s, *inner, plan)
        dashpot = c1 * y_rate * (scales.at[2] if scales.at.shape[1] else 1.0)
        force = dashpot + c.k1 * motion.x - c.f0 + self._beside
        return Trajectory(force, y, zeta, field.u, plan), J

    def _empty(self) -> Array:
        """(N, U) zeros for the slopes over ``UNKNOWNS`` and the parameters of the effects."""
        return np.zeros((len(self._motion.x), len(UNKNOWNS) + sum(len(e.values) for e in self._setting.effects)))

    def _add_rest(self, J: Array) -> None:
        """What the force depends on beside the dashpot force, added to its slopes J (N, U)."""
        J[:, _K1] = self._motion.x
        J[:, _F0] = -1.0
        moving = [_FORCE_DELAY, *(len(UNKNOWNS) + at for at in self._motion.columns)]
        over_motion, own = channel.beside_slopes(self._setting, self._motion, self._h)
        rows = self._setting.coordinates.k1 * self._motion.dx + over_motion
        for column, row in zip(moving, rows, strict=True):
            J[:, column] += row
        for at, row in own:
            J[:, len(UNKNOWNS) + at] += row
        self._add_shifts(J)

    def _add_shifts(self, J: Array) -> None:
        """An effect that makes the force late acts as the delay does."""
        for at, _, _ in self._setting.acting("time_shift"):
            J[:, len(UNKNOWNS) + at] = J[:, _FORCE_DELAY]

    def yielding(
        self, plan: Plan, carrying: Array, fineness: float, slopes: bool
    ) -> tuple[Trajectory, Array | None]:
        """Trajectory and slopes (N, U) behind a connection (5,)."""
        c, h = self._setting.coordinates, self._h
        g = yielding.inputs_of(self._motion, self._field, self._scales, self._beside, h)
        fixed = np.array([*self._s, c.k1, c.f0, *carrying])
        start = np.array([self._setting.y0, self._zeta0, self._motion.v[0]])
        if not slopes:
            y, zeta, force = yielding.march(fixed, *g, h, start, fineness, plan)
            return Trajectory(force, y, zeta, self._field.u, plan), None
        over_motion, own = channel.beside_slopes(self._setting, self._motion, self._h)
        rows = yielding.derivatives_of(self._motion, self._field, self._scales, over_motion, own, h)
        y, zeta, force, partial = yielding_slopes.march_with_slopes(fixed, *g, h, start, fineness, plan, *rows)
        J = self._empty()
        J[:, _STRUCTURAL_COLUMNS] = partial[:, :STRUCTURAL]
        J[:, [_K1, _F0]] = partial[:, STRUCTURAL : STRUCTURAL + 2]
        for at, form, values in self._setting.acting("connection"):
            for k, row in enumerate(over_parameters(form.act, values, form.parameters)):
                J[:, len(UNKNOWNS) + at + k] += partial[:, STRUCTURAL + 2 : yielding.FIXED] @ row
        J[:, _Y0] = partial[:, yielding.FIXED]
        columns = [*self._columns, *(len(UNKNOWNS) + at for at, _ in own)]
        J[:, columns] = partial[:, yielding.FIXED + 1 :]
        self._add_shifts(J)
        return Trajectory(force, y, zeta, self._field.u, plan), J
