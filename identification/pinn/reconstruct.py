"""The network's own force, as the force channel would have recorded it."""

from collections.abc import Callable

import numpy as np

from identification.arrays import Array
from identification.damper import law
from identification.damper.coordinates import Coordinates
from identification.pinn import law_rows
from identification.pinn.batches import Learned
from identification.pinn.effect_terms import Acting, lateness
from identification.problem import COORDINATE_COUNT, Problem


def recorded_force(
    source: Learned, number: int, inner_velocity: Callable[[int, Array], Array], unknowns: Array, problem: Problem
) -> Array:
    """Force [N] (N,) of a piece, with what effects add; NaN outside of what was learned.

    Args:
        source: the piece.
        number: its place in the problem.
        inner_velocity: y' [m/s] of the network in a piece, by its number, at times [s].
        unknowns: (C,) shared unknowns.
        problem: what they are unknowns of.
    """
    shared = problem.space.to_coordinates(unknowns[:COORDINATE_COUNT])
    c = problem.condition(unknowns, number).of(shared)
    force_delay, drive_delay = problem.further_delays(unknowns)
    piece, h = source.piece, source.inputs.h
    late = piece.force_delay + force_delay + lateness(problem.active_effects(problem.whole(unknowns)))
    time = np.arange((len(piece.force) - 1) * source.finer + 1) * h / source.finer - late
    inside = np.clip(time, source.span.start, source.span.end)
    y_rate, passed = inner_velocity(number, inside), piece.low_pass.apply if piece.low_pass else _as_it_is
    if problem.effects:
        recorded = _with_effects(source, passed(y_rate), c, Acting(problem, [source], unknowns))
    else:
        x, _ = source.inputs.motion(inside)
        u = source.inputs.field(inside, c.eta, piece.drive_delay + drive_delay).u
        recorded = passed(law.force(y_rate, x, law.at_field(c.c1_a, c.c1_b, u), c.k1, 0.0) - c.f0)
    known = (time >= source.span.start - h) & (time <= source.span.end + h)
    return np.where(known[:: source.finer], recorded, np.nan)


def _with_effects(source: Learned, y_rate: Array, c: Coordinates, acting: Acting) -> Array:
    """Force [N] (N,) behind inner velocities [m/s] (N,) that have passed the channel, as the training sees it."""
    driven = acting.along(source)
    return np.asarray(law_rows.force(c._asdict() | {"y_rate": y_rate, "u": driven.field.u} | driven.values))


def _as_it_is(values: Array) -> Array:
    return values
