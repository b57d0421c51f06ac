"""The network's own force, as the force channel would have recorded it."""

from collections.abc import Callable

import numpy as np

from identification.arrays import Array
from identification.damper import law
from identification.pinn.batches import Learned
from identification.problem import COORDINATE_COUNT, Problem


def recorded_force(
    source: Learned, number: int, inner_velocity: Callable[[int, Array], Array], unknowns: Array, problem: Problem
) -> Array:
    """Force [N] (N,) of a piece; NaN outside of what was learned.

    Args:
        source: the piece.
        number: its place in the problem.
        inner_velocity: y' [m/s] of the network in a piece, by its number, at times [s].
        unknowns: (15,) shared unknowns.
        problem: what they are unknowns of.
    """
    c = problem.space.to_coordinates(unknowns[:COORDINATE_COUNT])
    force_delay, drive_delay = unknowns[COORDINATE_COUNT:] * problem.delay_prior
    piece, h = source.piece, source.inputs.h
    samples = np.arange((len(piece.force) - 1) * source.finer + 1) * h / source.finer
    time = samples - piece.force_delay - float(force_delay)
    inside = np.clip(time, source.span.start, source.span.end)
    x, _ = source.inputs.motion(inside)
    u = source.inputs.field(inside, c.eta, piece.drive_delay + float(drive_delay)).u
    force = law.force(inner_velocity(number, inside), x, c.c1_a + c.c1_b * u, c.k1, 0.0) - c.f0
    recorded = force if piece.low_pass is None else piece.low_pass.apply(force)
    known = (time >= source.span.start - h) & (time <= source.span.end + h)
    return np.where(known[:: source.finer], recorded, np.nan)
