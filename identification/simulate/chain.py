"""Simulation of the whole chain from an excitation to the recorded force, with exact sensitivities on request.

displacement, drive -> [displacement channel] -> [delay of the force channel] -> [mounting] -> law and parallel
forces -> [force channel] -> force. A force channel with a delay tau shows the force of the inputs tau earlier. The
delay is therefore applied to the smooth inputs. Interpolation of the force would round its corners.

Effects on the inputs (coil, displacement channel, backlash) and factors on the law are computed before the
integration. The integration takes field, motion and factors as arrays with their derivatives. Effects on the force
are computed after it. A compliant mount has a separate integrator, because the damper's displacement is then a
state.
"""

from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.simulate import channel, compliant_mount, inputs, memories
from identification.simulate.kernel import InputDerivatives, StepCounts, integrate, integrate_with_sensitivities
from identification.simulate.motion import DamperMotion, compute_damper_motion
from identification.simulate.scaling import ScaleFactors, compute_scale_factors
from identification.simulate.simulation_model import SENSITIVITY_COLUMNS, Excitation, Response, SimulationModel
from identification.simulate.step import STRUCTURAL_COUNT

MAX_TRAVEL = 0.1
"""Threshold on the change of zeta in one step [1]: above it, a sample takes more steps.

Origin: the error of the force then stays below 4e-5 of its standard deviation.
"""

_STRUCTURAL_COLUMNS = [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
"""Positions of the ten structural coordinates in ``SENSITIVITY_COLUMNS``; the next line has the others."""
_ETA, _K1, _F0, _Y0, _FORCE_DELAY, _DRIVE_DELAY = 5, 11, 12, 13, 14, 15


def simulate(
    model: SimulationModel,
    excitation: Excitation,
    step_counts: StepCounts | None = None,
    *,
    sensitivities: bool = False,
    max_travel: float = MAX_TRAVEL,
) -> Response:
    """Simulate the recorded force along an excitation, and its sensitivities over every unknown on request.

    Args:
        model: coordinates, delays and effects.
        excitation: motion and drive.
        step_counts: (N-1,) steps per sample of an earlier response; chosen here if None.
        sensitivities: True to compute the derivatives too; costs about as much as 2.5 simulations.
        max_travel: change of zeta above which a sample takes more than one step [1].
    """
    step_counts = np.zeros(len(excitation.displacement) - 1, np.uint8) if step_counts is None else step_counts
    motion = compute_damper_motion(model, excitation, sensitivities)
    field = inputs.compute_damper_field(model, excitation, sensitivities)
    scales = compute_scale_factors(model, excitation, motion, sensitivities)
    chain = _SimulationChain(model, excitation, motion, field, scales)
    carrying = compliant_mount.gather_connections(model)
    if carrying[0] > 0.0 or len(carrying) > compliant_mount.CONNECTION_COUNT:
        found, J = chain.simulate_compliant(step_counts, carrying, max_travel, sensitivities)
    else:
        found, J = chain.simulate_rigid(step_counts, max_travel, sensitivities)
    delays = [_FORCE_DELAY, *(len(SENSITIVITY_COLUMNS) + at for at, _, _ in model.select_forms("time_shift"))]
    force = channel.apply_force_channel(
        model, excitation, motion, found.force, J, len(SENSITIVITY_COLUMNS), delays
    )
    if J is None:
        return replace(found, force=force)
    names = [f"{e.effect.name}.{q.symbol}" for e in model.effects for q in e.form.parameters]
    return replace(found, force=force, sensitivities=J, columns=(*SENSITIVITY_COLUMNS, *names))


class _SimulationChain:
    """Simulation of one model along one excitation: inputs, integration and arrangement of the sensitivities."""

    def __init__(
        self,
        model: SimulationModel,
        excitation: Excitation,
        motion: DamperMotion,
        field: inputs.DamperField,
        scales: ScaleFactors,
    ) -> None:
        self._model, self._excitation = model, excitation
        self._motion, self._field, self._scales = motion, field, scales
        self._s = np.array([model.coordinates[i] for i in _STRUCTURAL_COLUMNS])
        self._zeta0 = memories.estimate_settled_hysteresis(motion.v)
        self._h = 1.0 / excitation.rate
        self._parallel_force = channel.compute_parallel_force(model, excitation, motion)
        extra = (*field.columns, -1, *motion.columns, *scales.columns)
        further = (_FORCE_DELAY if at < 0 else len(SENSITIVITY_COLUMNS) + at for at in extra)
        self._columns = [_ETA, _DRIVE_DELAY, *further]

    def simulate_rigid(
        self, step_counts: StepCounts, max_travel: float, sensitivities: bool
    ) -> tuple[Response, Array | None]:
        """Return response and sensitivities (N, U) on a rigid mount."""
        c, motion, field, scales = self._model.coordinates, self._motion, self._field, self._scales
        c1 = c.c1_a + c.c1_b * field.u
        y0, h = self._model.y0, self._h
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
        return Response(force, y, zeta, field.u, step_counts), J

    def _make_sensitivities(self) -> Array:
        """Return zeros (N, U) for sensitivities over ``SENSITIVITY_COLUMNS`` and the parameters of the effects."""
        return np.zeros(
            (len(self._motion.x), len(SENSITIVITY_COLUMNS) + sum(len(e.values) for e in self._model.effects))
        )

    def _add_static_terms(self, J: Array) -> None:
        """Add the derivatives of k1, offset and parallel forces to J (N, U), the sensitivities of the dashpot."""
        J[:, _K1] = self._motion.x
        J[:, _F0] = -1.0
        moving = [_FORCE_DELAY, *(len(SENSITIVITY_COLUMNS) + at for at in self._motion.columns)]
        over_motion, own = channel.differentiate_parallel_force(self._model, self._excitation, self._motion)
        rows = self._model.coordinates.k1 * self._motion.dx + over_motion
        for column, row in zip(moving, rows, strict=True):
            J[:, column] += row
        for at, row in own:
            J[:, len(SENSITIVITY_COLUMNS) + at] += row
        self._add_delay_terms(J)

    def _add_delay_terms(self, J: Array) -> None:
        """Copy the derivative over the force delay to effects that delay the force."""
        for at, _, _ in self._model.select_forms("time_shift"):
            J[:, len(SENSITIVITY_COLUMNS) + at] = J[:, _FORCE_DELAY]

    def simulate_compliant(
        self, step_counts: StepCounts, carrying: Array, max_travel: float, sensitivities: bool
    ) -> tuple[Response, Array | None]:
        """Return response and sensitivities (N, U) on a compliant mount, with its values (5,) or (5 + G,)."""
        c, h = self._model.coordinates, self._h
        g = compliant_mount.stack_inputs(self._motion, self._field, self._scales, self._parallel_force, h)
        fixed = np.array([*self._s, c.k1, c.f0, *carrying])
        start = np.array([self._model.y0, self._zeta0])
        if not sensitivities:
            y, zeta, force = compliant_mount.integrate(fixed, *g, h, start, max_travel, step_counts)
            return Response(force, y, zeta, self._field.u, step_counts), None
        over_motion, own = channel.differentiate_parallel_force(self._model, self._excitation, self._motion)
        rows = compliant_mount.stack_derivatives(self._motion, self._field, self._scales, over_motion, own, h)
        tabulated, table_rows = compliant_mount.differentiate_tables(self._model)
        y, zeta, force, partial = compliant_mount.integrate_with_sensitivities(
            fixed, *g, h, start, max_travel, step_counts, *rows, table_rows
        )
        J = self._make_sensitivities()
        J[:, _STRUCTURAL_COLUMNS] = partial[:, :STRUCTURAL_COUNT]
        J[:, [_K1, _F0, _Y0]] = partial[:, [compliant_mount.K1, compliant_mount.F0, compliant_mount.FIXED_COUNT]]
        further = [*(column for column, _ in own), *tabulated]
        columns = [*self._columns, *(len(SENSITIVITY_COLUMNS) + column for column in further)]
        J[:, columns] = partial[:, compliant_mount.FIXED_COUNT + 1 :]
        for column, row in compliant_mount.differentiate_connections(self._model, partial):
            J[:, len(SENSITIVITY_COLUMNS) + column] += row
        self._add_delay_terms(J)
        return Response(force, y, zeta, self._field.u, step_counts), J
