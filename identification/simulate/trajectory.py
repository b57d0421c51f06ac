"""The whole chain from a recording's inputs to its force, with exact sensitivities where asked.

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
from identification.simulate import channel, compliant_mount, compliant_sensitivities, inputs
from identification.simulate.curves import differentiate_by_parameters
from identification.simulate.kernel import InputDerivatives, StepCounts, integrate, integrate_with_sensitivities
from identification.simulate.motion import DamperMotion, compute_damper_motion
from identification.simulate.scaling import ScaleFactors, compute_scale_factors
from identification.simulate.simulation_model import SENSITIVITY_COLUMNS, Excitation, SimulationModel, Trajectory
from identification.simulate.step import STRUCTURAL_COUNT

MAX_TRAVEL = 0.1
"""[1] travel of zeta above which a sample takes more steps: 4e-5 of the force's deviation at most."""

_CONNECTION_COUNT = compliant_mount.FIXED_COUNT - STRUCTURAL_COUNT - 2
"""Numbers of a connection."""
_STRUCTURAL_COLUMNS = [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
"""Of the ten structural coordinates among ``UNKNOWNS``; the others stand in the next line."""
_ETA, _K1, _F0, _Y0, _FORCE_DELAY, _DRIVE_DELAY = 5, 11, 12, 13, 14, 15


def simulate(
    setting: SimulationModel,
    stroke: Excitation,
    step_counts: StepCounts | None = None,
    *,
    sensitivities: bool = False,
    max_travel: float = MAX_TRAVEL,
) -> Trajectory:
    """Force of the damper along a recording, and its sensitivities over every unknown if asked.

    Args:
        setting: coordinates, delays, effects.
        stroke: the inputs.
        step_counts: steps per sample of an earlier trajectory; chosen anew if None.
        sensitivities: also the derivatives; costs some two and a half plain simulations.
        max_travel: travel of the hysteretic state above which a sample takes more than one step [1].
    """
    step_counts = np.zeros(len(stroke.displacement) - 1, np.uint8) if step_counts is None else step_counts
    motion = compute_damper_motion(setting, stroke, sensitivities)
    field = inputs.compute_damper_field(setting, stroke, sensitivities)
    scales = compute_scale_factors(setting, stroke, motion, sensitivities)
    chain = _SimulationChain(setting, stroke, motion, field, scales)
    carrying = sum_connections(setting)
    if carrying[0] > 0.0:
        found, J = chain.simulate_compliant(step_counts, carrying, max_travel, sensitivities)
    else:
        found, J = chain.simulate_rigid(step_counts, max_travel, sensitivities)
    delays = [_FORCE_DELAY, *(len(SENSITIVITY_COLUMNS) + at for at, _, _ in setting.select_forms("time_shift"))]
    force = channel.apply_force_channel(setting, stroke, motion, found.force, J, len(SENSITIVITY_COLUMNS), delays)
    if J is None:
        return replace(found, force=force)
    names = [f"{e.effect.name}.{q.symbol}" for e in setting.effects for q in e.form.parameters]
    return replace(found, force=force, sensitivities=J, columns=(*SENSITIVITY_COLUMNS, *names))


def sum_connections(setting: SimulationModel) -> Array:
    """(5,) what carries the damper, as ``Form`` says of "connection"; zero where rigid."""
    # Without any the sum over no rows is zero, which is rigid.
    parts = [form.function(*values) for _, form, values in setting.select_forms("connection")]
    return np.asarray(np.sum(np.array(parts, float).reshape(-1, _CONNECTION_COUNT), axis=0))


class _SimulationChain:
    """One stroke through one setting: its inputs as the march takes them, its answers as the fit wants them."""

    def __init__(
        self,
        setting: SimulationModel,
        stroke: Excitation,
        motion: DamperMotion,
        field: inputs.DamperField,
        scales: ScaleFactors,
    ) -> None:
        self._setting, self._stroke = setting, stroke
        self._motion, self._field, self._scales = motion, field, scales
        self._s = np.array([setting.coordinates[i] for i in _STRUCTURAL_COLUMNS])
        self._zeta0 = inputs.estimate_settled_hysteresis(motion.v[0])
        self._h = 1.0 / stroke.rate
        self._parallel_force = channel.compute_parallel_force(setting, motion, self._h)
        extra = (*field.columns, -1, *motion.columns, *scales.columns)
        self._columns = [
            _ETA,
            _DRIVE_DELAY,
            *(_FORCE_DELAY if at < 0 else len(SENSITIVITY_COLUMNS) + at for at in extra),
        ]

    def simulate_rigid(
        self, step_counts: StepCounts, max_travel: float, sensitivities: bool
    ) -> tuple[Trajectory, Array | None]:
        """Trajectory and sensitivities (N, U) where the damper moves with the actuator."""
        c, motion, field, scales = self._setting.coordinates, self._motion, self._field, self._scales
        c1 = c.c1_a + c.c1_b * field.u
        y0, h = self._setting.y0, self._h
        inner = (
            motion.x,
            motion.v,
            field.u,
            field.middle,
            scales.values,
            scales.midpoints,
            h,
            y0,
            self._zeta0,
            max_travel,
        )
        J = None
        if sensitivities:
            J = self._make_sensitivities()
            over = InputDerivatives(
                field.du, field.dmiddle, motion.dx, motion.dv, scales.derivatives, scales.midpoint_derivatives
            )
            columns = np.array([*_STRUCTURAL_COLUMNS, _Y0, *self._columns])
            y, zeta, y_rate = integrate_with_sensitivities(self._s, c1, *inner, step_counts, over, columns, J)
            self._add_static_terms(J)
        else:
            y, zeta, y_rate = integrate(self._s, *inner, step_counts)
        dashpot = c1 * y_rate * (scales.values[2] if scales.values.shape[1] else 1.0)
        force = dashpot + c.k1 * motion.x - c.f0 + self._parallel_force
        return Trajectory(force, y, zeta, field.u, step_counts), J

    def _make_sensitivities(self) -> Array:
        """(N, U) zeros for the sensitivities over ``UNKNOWNS`` and the parameters of the effects."""
        return np.zeros(
            (len(self._motion.x), len(SENSITIVITY_COLUMNS) + sum(len(e.values) for e in self._setting.effects))
        )

    def _add_static_terms(self, J: Array) -> None:
        """What the force depends on beside the dashpot force, added to its sensitivities J (N, U)."""
        J[:, _K1] = self._motion.x
        J[:, _F0] = -1.0
        moving = [_FORCE_DELAY, *(len(SENSITIVITY_COLUMNS) + at for at in self._motion.columns)]
        over_motion, own = channel.differentiate_parallel_force(self._setting, self._motion, self._h)
        rows = self._setting.coordinates.k1 * self._motion.dx + over_motion
        for column, row in zip(moving, rows, strict=True):
            J[:, column] += row
        for at, row in own:
            J[:, len(SENSITIVITY_COLUMNS) + at] += row
        self._add_delay_terms(J)

    def _add_delay_terms(self, J: Array) -> None:
        """An effect that makes the force late acts as the delay does."""
        for at, _, _ in self._setting.select_forms("time_shift"):
            J[:, len(SENSITIVITY_COLUMNS) + at] = J[:, _FORCE_DELAY]

    def simulate_compliant(
        self, step_counts: StepCounts, carrying: Array, max_travel: float, sensitivities: bool
    ) -> tuple[Trajectory, Array | None]:
        """Trajectory and sensitivities (N, U) behind a connection (5,)."""
        c, h = self._setting.coordinates, self._h
        g = compliant_mount.stack_inputs(self._motion, self._field, self._scales, self._parallel_force, h)
        fixed = np.array([*self._s, c.k1, c.f0, *carrying])
        start = np.array([self._setting.y0, self._zeta0, self._motion.v[0]])
        if not sensitivities:
            y, zeta, force = compliant_mount.integrate(fixed, *g, h, start, max_travel, step_counts)
            return Trajectory(force, y, zeta, self._field.u, step_counts), None
        over_motion, own = channel.differentiate_parallel_force(self._setting, self._motion, self._h)
        rows = compliant_mount.stack_derivatives(self._motion, self._field, self._scales, over_motion, own, h)
        y, zeta, force, partial = compliant_sensitivities.integrate_with_sensitivities(
            fixed, *g, h, start, max_travel, step_counts, *rows
        )
        J = self._make_sensitivities()
        J[:, _STRUCTURAL_COLUMNS] = partial[:, :STRUCTURAL_COUNT]
        J[:, [_K1, _F0]] = partial[:, STRUCTURAL_COUNT : STRUCTURAL_COUNT + 2]
        for at, form, values in self._setting.select_forms("connection"):
            for k, row in enumerate(differentiate_by_parameters(form.function, values, form.parameters)):
                J[:, len(SENSITIVITY_COLUMNS) + at + k] += (
                    partial[:, STRUCTURAL_COUNT + 2 : compliant_mount.FIXED_COUNT] @ row
                )
        J[:, _Y0] = partial[:, compliant_mount.FIXED_COUNT]
        columns = [*self._columns, *(len(SENSITIVITY_COLUMNS) + at for at, _ in own)]
        J[:, columns] = partial[:, compliant_mount.FIXED_COUNT + 1 :]
        self._add_delay_terms(J)
        return Trajectory(force, y, zeta, self._field.u, step_counts), J
