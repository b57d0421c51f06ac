"""Weighted residuals of the network of elements: force misfits at the samples, law residuals at Gauss points.

Law residuals are weighted with test functions of the element (Galerkin's method). Parts that the basis functions
cannot follow, such as the roughness of a measured velocity, are orthogonal to the test functions and have no
effect. At single points (collocation) they would bias the parameters, and multipliers would accumulate them
without limit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COMMON_COUNT, COORDINATE_COUNT, Problem
from identification.pinn.common import Y_UNIT, Batch, ResidualInputs, law_residuals
from identification.pinn.elements.mesh import OutputWeights
from identification.pinn.elements.resolved_unknowns import ResolvedUnknowns, resolve_unknowns

HYSTERESIS_SCALE, BALANCE_SCALE = 0.7, 10.0
"""Scales of law residuals [1]: hysteresis over the slip velocity at breakthrough, balance over the force noise.

A law residual of its scale counts as much as a force misfit of one standard deviation at a sample.
"""
_ETA_COLUMN = Coordinates._fields.index("eta")
_FORCE_DELAY_COLUMN, _DRIVE_DELAY_COLUMN = COORDINATE_COUNT, COORDINATE_COUNT + 1


class LossWeights(NamedTuple):
    """Weights of the parts of the loss."""

    law_weight: float
    """Weight of the law residuals against the force misfit [1]."""
    noise: float
    """Force noise that scales force misfits [N]."""


@dataclass(frozen=True)
class WeightedResiduals:
    """Weighted residuals of a batch, with their Jacobian on request."""

    hysteresis: Array
    """Residuals of eq. 3 (K, rank)."""
    balance: Array
    """Residuals of eq. 4 (K, rank)."""
    misfit: Array
    """Force misfits (K, S)."""
    jacobian: Array | None = None
    """Jacobian (K, 2 rank + S, 2 rank + C) over the weights of z, those of y, and the C shared unknowns."""

    @property
    def vector(self) -> Array:
        """All residuals (K, 2 rank + S)."""
        return np.concatenate([self.hysteresis, self.balance, self.misfit], 1)

    def add_multipliers(self, multipliers: "WeightedResiduals") -> "WeightedResiduals":
        """Return the residuals with accumulated law residuals; the last test function would grow without limit."""
        hysteresis, balance = self.hysteresis.copy(), self.balance.copy()
        hysteresis[:, :-1] += multipliers.hysteresis[:, :-1]
        balance[:, :-1] += multipliers.balance[:, :-1]
        return replace(self, hysteresis=hysteresis, balance=balance)


class _ResidualTerm(NamedTuple):
    """One kind of residual at a batch's points, with its partials by name."""

    value: Array
    partials: dict[str, Array]
    """Partials over the quantities in the equation; empty unless requested."""
    inputs: ResidualInputs


@dataclass(frozen=True)
class ElementLoss:
    """Loss of the network of elements, over its output weights and the shared unknowns of a problem."""

    problem: Problem
    batches: Sequence[Batch]
    grid_delay: float
    """Force delay, with that of effects, with which the batches' grids were made [s]."""

    def compute_weighted_residuals(
        self,
        unknowns: Array,
        output_weights: OutputWeights,
        weights: LossWeights,
        multipliers: Sequence[WeightedResiduals] | None = None,
        *,
        jacobian: bool,
    ) -> list[WeightedResiduals]:
        """Return the weighted residuals of every batch.

        Args:
            unknowns: shared unknowns (C,).
            output_weights: output weights of all elements.
            weights: weights of the parts of the loss.
            multipliers: accumulated law residuals of each batch; None without multipliers.
            jacobian: whether to compute the Jacobian.
        """
        resolved = resolve_unknowns(self.problem, self.batches, unknowns, self.grid_delay)
        shifts: Sequence[WeightedResiduals | None] = multipliers or [None] * len(self.batches)
        batch_residuals = []
        for b, r, shift in zip(self.batches, resolved, shifts, strict=True):
            plain = self._compute_batch(b, r, output_weights, weights, jacobian)
            batch_residuals.append(plain if shift is None else plain.add_multipliers(shift))
        return batch_residuals

    def compute_residuals(
        self, unknowns: Array, output_weights: OutputWeights
    ) -> Iterator[tuple[Array, Array, Array]]:
        """Yield unweighted residuals by batch: eq. 3 [m/s] and eq. 4 [N] at Gauss points, force [N] at samples."""
        resolved = resolve_unknowns(self.problem, self.batches, unknowns, self.grid_delay)
        for b, r in zip(self.batches, resolved, strict=True):
            hysteresis, balance = _compute_law_residuals(b, r, output_weights, jacobian=False)
            force = _compute_force(b, r, output_weights, jacobian=False)
            yield hysteresis.value, balance.value, force.value - b.force

    def _compute_batch(
        self, b: Batch, r: ResolvedUnknowns, output_weights: OutputWeights, weights: LossWeights, jacobian: bool
    ) -> WeightedResiduals:
        hysteresis, balance = _compute_law_residuals(b, r, output_weights, jacobian)
        force = _compute_force(b, r, output_weights, jacobian)
        law_scale = weights.law_weight * b.point_weights
        scales = (
            law_scale / (HYSTERESIS_SCALE * b.slip_velocity[:, None]),
            law_scale / (BALANCE_SCALE * weights.noise),
            b.sample_weights / weights.noise,
        )
        residuals = WeightedResiduals(
            (hysteresis.value * scales[0]) @ b.weighted_tests,
            (balance.value * scales[1]) @ b.weighted_tests,
            (force.value - b.force) * scales[2],
        )
        if not jacobian:
            return residuals
        return replace(residuals, jacobian=self._compute_jacobian(b, r, (hysteresis, balance, force), scales))

    def _compute_jacobian(
        self,
        b: Batch,
        r: ResolvedUnknowns,
        terms: tuple[_ResidualTerm, _ResidualTerm, _ResidualTerm],
        scales: tuple[Array, Array, Array],
    ) -> Array:
        """Return the Jacobian of a batch, filled block by block."""
        hysteresis, balance, force = (
            {name: partial * scale for name, partial in term.partials.items()}
            for term, scale in zip(terms, scales, strict=True)
        )
        points, rank = b.basis.shape
        z, y = slice(rank), slice(rank, 2 * rank)
        shared = len(self.problem.shared_columns)
        law = np.zeros((2, len(b.elements), points, 2 * rank + shared))
        law[0, ..., z] = hysteresis["z"][..., None] * b.basis + hysteresis["z_rate"][..., None] * b.basis_rates
        law[0, ..., y] = Y_UNIT * hysteresis["y_rate"][..., None] * b.basis_rates
        law[1, ..., z] = balance["z"][..., None] * b.basis
        law[1, ..., y] = Y_UNIT * (
            balance["y"][..., None] * b.basis + balance["y_rate"][..., None] * b.basis_rates
        )
        samples = np.zeros((len(b.elements), b.sample_weights.shape[1], 2 * rank + shared))
        rates = b.sample_basis_rates
        if r.force_delay:
            rates = rates - r.force_delay * b.sample_basis_curvatures
        samples[..., y] = Y_UNIT * force["y_rate"][..., None] * rates
        for table, partials, term in zip((*law, samples), (hysteresis, balance, force), terms, strict=True):
            table[..., 2 * rank :] = self._compute_shared_columns(partials, term.inputs, r)
        return np.concatenate([*(b.weighted_tests.T @ law), samples], 1)

    def _compute_shared_columns(
        self, partials: dict[str, Array], inputs: ResidualInputs, r: ResolvedUnknowns
    ) -> Array:
        """Return the derivatives (K, M, C) over the shared unknowns."""
        table = np.zeros((*inputs.field.u.shape, len(self.problem.shared_columns)))
        coordinates = table[..., :COORDINATE_COUNT]
        for i, name in enumerate(Coordinates._fields):
            if name in partials:
                coordinates[..., i] = partials[name]
        if "u" in partials:
            coordinates[..., _ETA_COLUMN] = partials["u"] * inputs.field.du_deta
            table[..., _DRIVE_DELAY_COLUMN] = self.problem.delay_prior * partials["u"] * inputs.field.du_ddelay
        self._add_input_columns(table, partials, inputs, r.value_derivatives)
        search = coordinates @ r.search_jacobian
        coordinates[...] = search[..., :COORDINATE_COUNT]
        table[..., COMMON_COUNT + len(r.value_derivatives) :] = search[..., COORDINATE_COUNT:]
        return table

    def _add_input_columns(
        self, table: Array, partials: dict[str, Array], inputs: ResidualInputs, value_derivatives: Array
    ) -> None:
        """Add the derivatives over the force delay and the effect parameters, through the inputs of the law."""
        # In the order of a dict: that of a set of strings, and with it the rounding, differs between processes.
        for name in (n for n in inputs.partials if n in partials):
            over_delay, *over_parameters = inputs.partials[name]
            table[..., _FORCE_DELAY_COLUMN] += self.problem.delay_prior * partials[name] * over_delay
            for k, row in enumerate(over_parameters):
                table[..., COMMON_COUNT + k] += partials[name] * row * value_derivatives[k]


def _compute_law_residuals(
    b: Batch, r: ResolvedUnknowns, output_weights: OutputWeights, jacobian: bool
) -> tuple[_ResidualTerm, _ResidualTerm]:
    """Return the residuals of eqs. 3 and 4 at a batch's Gauss points."""
    inputs = r.evaluate_points(b)
    values = r.coordinates._asdict() | _evaluate_states(b, output_weights) | {"u": inputs.field.u} | inputs.values
    hysteresis = law_residuals.differentiate_hysteresis(values, np.log) if jacobian else {}
    balance = law_residuals.differentiate_balance(values) if jacobian else {}
    if jacobian and r.effect_terms:
        hysteresis["v"] = -hysteresis["y_rate"]
        balance |= law_residuals.differentiate_balance_inputs(values)
    return (
        _ResidualTerm(law_residuals.compute_hysteresis_residual(values), hysteresis, inputs),
        _ResidualTerm(law_residuals.compute_balance_residual(values), balance, inputs),
    )


def _evaluate_states(b: Batch, output_weights: OutputWeights) -> dict[str, Array]:
    """Return states, their rates and the motion (K, M) at a batch's Gauss points by name."""
    z, y = output_weights.select(b.left_node, b.elements)
    return {
        "z": z @ b.basis.T,
        "z_rate": _combine(b.basis_rates, z),
        "y": y @ b.basis.T * Y_UNIT,
        "y_rate": _combine(b.basis_rates, y) * Y_UNIT,
        "x": b.motion[0],
        "v": b.motion[1],
    }


def _compute_force(b: Batch, r: ResolvedUnknowns, output_weights: OutputWeights, jacobian: bool) -> _ResidualTerm:
    """Return the network's force at a batch's samples, as the channel records it."""
    _, y = output_weights.select(b.left_node, b.elements)
    inputs = r.evaluate_samples(b)
    y_acceleration = _combine(b.sample_basis_curvatures, y) * Y_UNIT
    y_rate = _combine(b.sample_basis_rates, y) * Y_UNIT - r.force_delay * y_acceleration + b.filter_memory
    values = r.coordinates._asdict() | {"y_rate": y_rate, "u": inputs.field.u} | inputs.values
    force = law_residuals.compute_force(values)
    if not jacobian:
        return _ResidualTerm(force, {}, inputs)
    partials = law_residuals.differentiate_force(values)
    if r.effect_terms:
        partials |= law_residuals.differentiate_force_inputs(values)
    # A delayed force belongs to an earlier motion and an earlier field.
    over_delay = {"y_rate": -inputs.delay_factors[:, None, None] * y_acceleration}
    return _ResidualTerm(force, partials, inputs._replace(partials=inputs.partials | over_delay))


def _combine(functions: Array, weights: Array) -> Array:
    """Return (K, M) from functions (K, M, rank) and output weights (K, rank)."""
    return np.asarray((functions @ weights[..., None])[..., 0])
