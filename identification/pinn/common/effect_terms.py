"""Effect terms: contributions of effects to the network's residuals.

An effect changes the inputs of the law (field, motion, factors of F, c0 and c1) or adds a parallel force. Both
follow from a recording's inputs alone, by functions of the simulation that precede its integration. No state of
the law is needed for them, and nothing is simulated. With backlash or compliance in the mounting, the damper's
motion depends on its force or on its past. It would be a third state of the network. Such effects are not
supported.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.effects import Action, Form
from identification.fitting import COMMON_COUNT, COORDINATE_COUNT, Problem
from identification.pinn.common.inputs import FieldSamples
from identification.pinn.common.training_pieces import Batch, TrainingPiece
from identification.simulate import (
    COIL_ACTIONS,
    ActiveEffect,
    DamperMotion,
    Excitation,
    SimulationModel,
    apply_force_channel,
    compute_damper_field,
    compute_damper_motion,
    compute_parallel_force,
    compute_scale_factors,
    differentiate_parallel_force,
)

_UNSUPPORTED_ACTIONS: tuple[Action, ...] = (
    "displacement_backlash",
    "connection",
    "elongation_function",
    "force_lag",
    "channel_function",
    "channel_response",
    "displacement_function",
)
"""Backlash and compliance, and channels through which the network's force or motion would have to pass as well."""
_FACTOR_NAMES = ("F_factor", "c0_factor", "c1_factor")

InputPartials = dict[str, Array]
"""Partials of inputs by the input's name: over the force delay, then over each effect parameter."""


class ResidualInputs(NamedTuple):
    """Quantities in the residuals at some points, except states and coordinates."""

    field: FieldSamples
    values: dict[str, Array]
    """By name: ``x`` [m], ``v`` [m/s], factors [1], ``parallel_force`` [N]."""
    partials: InputPartials
    """Partials of these values and of the field ``u``."""
    delay_factors: Array
    """Change of the force delay with the residual delay and with each effect parameter (1 + P,); 1 for a delay."""

    def resample(self, table: Callable[[Array], Array]) -> "ResidualInputs":
        """Return the inputs at other points, with every array looked up by the same function."""
        return ResidualInputs(
            FieldSamples(*(table(row) for row in self.field)),
            {name: table(row) for name, row in self.values.items()},
            {name: table(rows) for name, rows in self.partials.items()},
            self.delay_factors,
        )


def is_supported(form: Form) -> bool:
    """Return whether an effect of this form can be a term of the residuals."""
    return form.action not in _UNSUPPORTED_ACTIONS


class EffectTerms:
    """Effect terms of a problem for one vector of unknowns, at the points and samples of its pieces.

    Args:
        problem: problem with the effects.
        sources: its training pieces.
        unknowns: shared unknowns (C,).
    """

    def __init__(self, problem: Problem, sources: Sequence[TrainingPiece], unknowns: Array) -> None:
        coordinates = problem.space.to_coordinates(unknowns[:COORDINATE_COUNT])
        effects = problem.make_active_effects(problem.expand_shared(unknowns))
        force_delay, drive_delay = problem.compute_residual_delays(unknowns)
        self.delay = compute_effect_delay(effects)
        """Delay [s] that the effects add between recorded motion and force."""
        self._piece_terms = {
            s.number: _PieceTerms(
                SimulationModel(
                    coordinates,
                    force_delay=s.piece.force_delay + s.lag + force_delay,
                    drive_delay=s.piece.drive_delay + drive_delay,
                    effects=effects,
                ),
                s,
            )
            for s in sources
        }

    def evaluate_points(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the Gauss points of a batch."""
        return self._piece_terms[b.source.number].evaluate_points(b)

    def evaluate_samples(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the samples of a batch."""
        return self._piece_terms[b.source.number].evaluate_samples(b)

    def evaluate_piece(self, source: TrainingPiece) -> ResidualInputs:
        """Return the inputs at all samples of a piece."""
        return self._piece_terms[source.number].samples


def compute_effect_deviations(problem: Problem, unknowns: Array, covariance: Array) -> Array:
    """Return the standard deviations (P,) [SI] of the effect parameters from a covariance (C, C)."""
    variances = np.diag(covariance)[COMMON_COUNT : COMMON_COUNT + problem.layout.effect_count]
    return np.sqrt(np.maximum(variances, 0.0)) * problem.differentiate_effects(problem.expand_shared(unknowns))


def compute_effect_delay(effects: Sequence[ActiveEffect]) -> float:
    """Return the delay [s] that effects add between recorded motion and force."""
    signs = {"time_shift": 1.0, "displacement_shift": -1.0}
    return sum(signs.get(e.form.action, 0.0) * e.values[0] for e in effects)


class _PieceTerms:
    """Effect terms of one piece: tables at its samples, and at the samples and half-way between them."""

    def __init__(self, model: SimulationModel, source: TrainingPiece) -> None:
        self._model, self._source = model, source
        self._count = 1 + sum(len(e.values) for e in model.effects)
        self._delayed_columns = [1 + first for first, _, _ in model.select_forms("time_shift")]
        self._advanced_columns = [1 + first for first, _, _ in model.select_forms("displacement_shift")]

    def evaluate_samples(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the samples of a batch, without any interpolation."""
        return self.samples.resample(lambda table: table[..., b.samples])

    def evaluate_points(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the Gauss points of a batch, interpolated linearly between half steps."""
        # Short of the last point, so that a right neighbour exists everywhere.
        last = self._half_step_inputs.field.u.shape[-1] - 1.001
        position = np.clip(2.0 * b.time / b.source.inputs.h, 0.0, last)
        i = position.astype(np.int64)
        t = position - i
        inputs = self._half_step_inputs.resample(lambda table: (1.0 - t) * table[..., i] + t * table[..., i + 1])
        if not self._model.select_forms(*COIL_ACTIONS):
            # No effect changes the field, so its closed form holds.
            inputs = inputs._replace(field=self._compute_field(b))
            inputs.partials["u"][self._advanced_columns] = inputs.field.du_ddelay
        values, partials = self._correct_motion(*b.motion)
        return inputs._replace(values=inputs.values | values, partials=inputs.partials | partials)

    def _compute_field(self, b: Batch) -> FieldSamples:
        advance = sum(values[0] for _, _, values in self._model.select_forms("displacement_shift"))
        return b.source.inputs.evaluate_field(
            b.time, self._model.coordinates.eta, self._model.drive_delay + advance
        )

    @cached_property
    def samples(self) -> ResidualInputs:
        """Inputs at the time at which each sample's force acted."""
        model, excitation = self._model, self._source.piece.excitation
        motion = compute_damper_motion(model, excitation)
        field, scales = compute_damper_field(model, excitation), compute_scale_factors(model, excitation, motion)
        motion_columns = (0, *(1 + k for k in motion.columns))
        force, force_partials = self._compute_parallel_force(motion, motion_columns)
        values = {"x": motion.x, "parallel_force": force}
        partials = {
            "x": self._scatter_columns(motion_columns, motion.dx),
            "parallel_force": force_partials,
            "u": self._scatter_columns((*(1 + k for k in field.columns), 0), field.du[2:]),
        }
        if scales.values.shape[1]:
            # Of the three factors, only that of c1 is in the force; the others enter the law at the Gauss points.
            columns = (*motion_columns, *(1 + k for k in scales.columns))
            values["c1_factor"] = scales.values[2]
            partials["c1_factor"] = self._scatter_columns(columns, scales.derivatives[:, 2])
        return ResidualInputs(FieldSamples(field.u, *field.du[:2]), values, partials, self._make_delay_factors())

    def _make_delay_factors(self) -> Array:
        factors = np.zeros(self._count)
        factors[[0, *self._delayed_columns]], factors[self._advanced_columns] = 1.0, -1.0
        return factors

    def _compute_parallel_force(
        self, motion: DamperMotion, motion_columns: tuple[int, ...]
    ) -> tuple[Array, Array]:
        """Return the parallel force [N] (N,) in the force channel, and its partials (1 + P, N)."""
        model, excitation = self._model, self._source.piece.excitation
        over_motion, over_parameters = differentiate_parallel_force(model, excitation, motion)
        J = self._scatter_columns(motion_columns, over_motion)
        for k, row in over_parameters:
            J[1 + k] += row
        force = compute_parallel_force(model, excitation, motion)
        return apply_force_channel(model, excitation, motion, force, J.T, 1, [0, *self._delayed_columns]), J

    @cached_property
    def _half_step_inputs(self) -> ResidualInputs:
        """Inputs on the displacement channel's own time, at the samples and half-way between them."""
        excitation = self._source.piece.excitation
        model = replace(self._model, force_delay=-compute_effect_delay(self._model.effects))
        motion, field = compute_damper_motion(model, excitation), compute_damper_field(model, excitation)
        scales = compute_scale_factors(model, excitation, motion)
        u, du = _interleave(field.u, field.middle), _interleave(field.du, field.dmiddle)
        partials = {"u": self._scatter_columns(tuple(1 + k for k in field.columns), du[2:-1])}
        partials["u"][self._advanced_columns] = du[1]
        values = {}
        if scales.values.shape[1]:
            values = dict(zip(_FACTOR_NAMES, _interleave(scales.values, scales.midpoints), strict=True))
            columns = [1 + k for k in (*motion.columns, *scales.columns)]
            derivatives = _interleave(scales.derivatives, scales.midpoint_derivatives)[1:]
            rows = self._scatter_columns(columns, derivatives.swapaxes(0, 1))
            # On the displacement channel's own time, the motion does not depend on a shift of that channel.
            rows[:, self._advanced_columns] = 0.0
            partials |= dict(zip(_FACTOR_NAMES, rows, strict=True))
        return ResidualInputs(FieldSamples(u, du[0], du[1]), values, partials, np.zeros(self._count))

    def _correct_motion(self, x: Array, v: Array) -> tuple[dict[str, Array], InputPartials]:
        """Return motion (K, M) and its partials where the displacement channel is nonlinear; else empty tables."""
        maps = self._model.select_forms("displacement_map")
        if not maps:
            return {}, {}
        effects = tuple(e for e in self._model.effects if e.form.action == "displacement_map")
        # A map acts on each instant alone, so any rate and acceleration will do.
        flat = Excitation(1.0, x.ravel(), v.ravel(), np.zeros(x.size), np.zeros(x.size))
        motion = compute_damper_motion(SimulationModel(self._model.coordinates, effects=effects), flat)
        columns = [1 + first + k for first, _, values in maps for k in range(len(values))]
        values = {"x": motion.x.reshape(x.shape), "v": motion.v.reshape(x.shape)}
        partials = {
            name: self._scatter_columns(columns, rows[1:]).reshape(self._count, *x.shape)
            for name, rows in (("x", motion.dx), ("v", motion.dv))
        }
        return values, partials

    def _scatter_columns(self, columns: Sequence[int], rows: Array) -> Array:
        """Return partials (..., 1 + P, N) from rows (..., R, N) over some columns; a time shift is a delay."""
        table = np.zeros((*rows.shape[:-2], self._count, rows.shape[-1]))
        for column, k in zip(columns, range(rows.shape[-2]), strict=True):
            table[..., column, :] += rows[..., k, :]
        table[..., self._delayed_columns, :] += table[..., :1, :]
        return table


def _interleave(samples: Array, midpoints: Array) -> Array:
    """Return (..., 2N - 1) from values (..., N) at the samples and (..., N - 1) half-way between them."""
    joined = np.empty((*samples.shape[:-1], 2 * samples.shape[-1] - 1))
    joined[..., ::2], joined[..., 1::2] = samples, midpoints
    return joined
