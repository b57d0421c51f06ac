"""What noise of the displacement becomes in the force of a simulation.

It is not in the recorded force, so that no comparison of cycles shows it: it enters through the model's input, and
where the loop is steep a tenth of a micrometre is a newton. So it is played again: the motion gets fresh noise, is
estimated anew in the same way, and the force simulated on it is compared with that on the motion as it was.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.motion import recorded_noise
from identification.motion_noise import with_motion
from identification.piece import Piece
from identification.problem import Problem
from identification.recordings import Stretch


def replayed(
    stretches: Sequence[Stretch],
    pieces: Sequence[Piece],
    forces: Sequence[Array],
    noise: float,
    seed: int,
    draws: Sequence[int],
) -> list[tuple[Piece, ...]]:
    """The pieces with motions estimated from fresh noise, some draws of them.

    Args:
        stretches: as recorded, one a piece.
        pieces: with the motion as it was estimated.
        forces: (N,) simulated [N], one a piece: the actuator gives way under them.
        noise: of the recorded force [N].
        seed: of the noise.
        draws: numbers of the draws.
    """
    return [
        tuple(
            _replayed(stretch, piece, force, noise, np.random.default_rng([seed, i, draw]))
            for i, (stretch, piece, force) in enumerate(zip(stretches, pieces, forces, strict=True))
        )
        for draw in draws
    ]


def _replayed(stretch: Stretch, piece: Piece, force: Array, noise: float, random: np.random.Generator) -> Piece:
    played = replace(
        stretch,
        displacement=piece.stroke.displacement + recorded_noise(stretch) * random.standard_normal(len(force)),
        force=force + noise * random.standard_normal(len(force)),
    )
    return with_motion(piece, played)


def carried(problem: Problem, unknowns: Array, draws: Sequence[Sequence[Piece]]) -> Array:
    """(draws, N) squared change [N²] of the simulated force, motion by motion; all pieces one after the other.

    Args:
        problem: what was fitted, with its effects.
        unknowns: (U,) where.
        draws: the pieces with other motions, as ``replayed`` makes them.
    """
    quick = problem.quicker()
    here = np.concatenate(quick.simulate(unknowns))
    moved = (replace(quick, pieces=tuple(p.quicker() for p in pieces)).simulate(unknowns) for pieces in draws)
    return np.stack([(np.concatenate(there) - here) ** 2 for there in moved])
