"""The network's own force, as the force channel would record it."""

from collections.abc import Callable

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates, law
from identification.fitting import COORDINATE_COUNT, Problem
from identification.pinn.common import law_residuals
from identification.pinn.common.effect_terms import EffectTerms, compute_effect_delay
from identification.pinn.common.training_pieces import TrainingPiece


def reconstruct_force(
    source: TrainingPiece,
    number: int,
    inner_velocity: Callable[[int, Array], Array],
    unknowns: Array,
    problem: Problem,
) -> Array:
    """Return the force [N] (N,) of a piece with the contributions of effects; NaN outside the learned span.

    Args:
        source: the piece.
        number: index of the piece in the problem.
        inner_velocity: function of a piece's index and of times [s] that returns the network's y' [m/s].
        unknowns: shared unknowns (C,).
        problem: problem with these unknowns.
    """
    shared = problem.space.to_coordinates(unknowns[:COORDINATE_COUNT])
    c = problem.find_correction(unknowns, number).apply(shared)
    force_delay, drive_delay = problem.compute_residual_delays(unknowns)
    piece, h = source.piece, source.inputs.h
    delay = (
        piece.force_delay
        + force_delay
        + compute_effect_delay(problem.make_active_effects(problem.expand_shared(unknowns)))
    )
    time = np.arange((len(piece.force) - 1) * source.oversampling + 1) * h / source.oversampling - delay
    inside = np.clip(time, source.span.start, source.span.end)
    y_rate, channel = inner_velocity(number, inside), piece.low_pass.apply if piece.low_pass else _pass_through
    if problem.effects:
        recorded = _compute_effect_force(source, channel(y_rate), c, EffectTerms(problem, [source], unknowns))
    else:
        x, _ = source.inputs.evaluate_motion(inside)
        u = source.inputs.evaluate_field(inside, c.eta, piece.drive_delay + drive_delay).u
        recorded = channel(
            law.compute_force(y_rate, x, law.evaluate_coefficient(c.c1_a, c.c1_b, u), c.k1, 0.0) - c.f0
        )
    learned = (time >= source.span.start - h) & (time <= source.span.end + h)
    return np.where(learned[:: source.oversampling], recorded, np.nan)


def _compute_effect_force(
    source: TrainingPiece, y_rate: Array, c: Coordinates, effect_terms: EffectTerms
) -> Array:
    """Return the force [N] (N,) with effects for filtered inner velocities [m/s] (N,), as in the loss."""
    inputs = effect_terms.evaluate_piece(source)
    return np.asarray(
        law_residuals.compute_force(c._asdict() | {"y_rate": y_rate, "u": inputs.field.u} | inputs.values)
    )


def _pass_through(values: Array) -> Array:
    return values
