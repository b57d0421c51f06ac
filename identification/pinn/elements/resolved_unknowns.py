"""Shared unknowns resolved for one log: coordinates, delays, effects, and the residuals' inputs for them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COORDINATE_COUNT, Problem
from identification.pinn.common import Batch, EffectTerms, ResidualInputs


class ResolvedUnknowns(NamedTuple):
    """The shared unknowns as they apply to one log."""

    coordinates: Coordinates
    search_jacobian: Array
    """Derivatives (13, 13 + O) of the coordinates over search coordinates and per-log parameters."""
    force_delay: float
    """Delay of the force [s] beyond the one with which the batches were made."""
    drive_delay: float
    """Residual delay of the drive [s]."""
    value_derivatives: Array
    """Derivatives (P,) of the effect parameters over their search coordinates."""
    effect_terms: EffectTerms | None
    """Effect terms; None without effects."""

    def evaluate_points(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the Gauss points of a batch."""
        if self.effect_terms:
            return self.effect_terms.evaluate_points(b)
        field = b.source.inputs.evaluate_field(
            b.time, self.coordinates.eta, b.source.piece.drive_delay + self.drive_delay
        )
        return ResidualInputs(field, {}, {}, np.ones(1))

    def evaluate_samples(self, b: Batch) -> ResidualInputs:
        """Return the inputs at the samples of a batch."""
        if self.effect_terms:
            return self.effect_terms.evaluate_samples(b)
        x, v = b.sample_motion
        drive_delay = b.source.piece.drive_delay + self.drive_delay
        field = b.source.inputs.evaluate_field(b.sample_time - self.force_delay, self.coordinates.eta, drive_delay)
        partials = {"x": -v[None], "u": field.du_ddelay[None]}
        return ResidualInputs(field, {"x": x - self.force_delay * v}, partials, np.ones(1))


def resolve_unknowns(
    problem: Problem, batches: Sequence[Batch], unknowns: Array, grid_delay: float
) -> list[ResolvedUnknowns]:
    """Return the shared unknowns as they apply to the log of each batch.

    Args:
        problem: problem with these unknowns.
        batches: batches of its elements.
        unknowns: shared unknowns (C,).
        grid_delay: force delay with which the batches were made [s].
    """
    common = _resolve_common(problem, batches, unknowns, grid_delay)
    if not problem.per_log:
        return [common] * len(batches)
    logs = {b.source.number: _resolve_log(problem, common, unknowns, b.source.number) for b in batches}
    return [logs[b.source.number] for b in batches]


def _resolve_common(
    problem: Problem, batches: Sequence[Batch], unknowns: Array, grid_delay: float
) -> ResolvedUnknowns:
    """Return the shared unknowns without any log correction."""
    q, space = unknowns[:COORDINATE_COUNT], problem.space
    force_delay, drive_delay = problem.compute_residual_delays(unknowns)
    effect_terms = None
    if problem.effects:
        sources = {b.source.number: b.source for b in batches}
        effect_terms = EffectTerms(problem, list(sources.values()), unknowns)
        force_delay += effect_terms.delay
    return ResolvedUnknowns(
        space.to_coordinates(q),
        space.differentiate(q),
        force_delay - grid_delay,
        drive_delay,
        problem.differentiate_effects(problem.expand_shared(unknowns)),
        effect_terms,
    )


def _resolve_log(problem: Problem, common: ResolvedUnknowns, unknowns: Array, piece: int) -> ResolvedUnknowns:
    """Return the shared unknowns with the correction of a piece's log."""
    correction = problem.find_correction(unknowns, piece)
    search_jacobian = np.hstack([common.search_jacobian, problem.differentiate_per_log(unknowns, piece)])
    return common._replace(
        coordinates=correction.apply(common.coordinates),
        search_jacobian=correction.apply_chain_rule(search_jacobian.T).T,
    )
