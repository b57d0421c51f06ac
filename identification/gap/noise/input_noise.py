"""Propagated input noise: change of the simulated force by noise of the recorded displacement (decision 0005).

The recorded force does not contain it, so a comparison of cycles does not show it. It enters through the input
of the simulation. Where the hysteresis loop is steep, a tenth of a micrometre changes the force by one newton.
The motion therefore gets new noise, is estimated again in the same way, and the simulated forces are compared.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.fitting import Piece, Problem
from identification.logs import Stretch
from identification.signals import estimate_recorded_noise
from identification.uncertainty import replace_motion


def resample_motion(
    stretches: Sequence[Stretch],
    pieces: Sequence[Piece],
    forces: Sequence[Array],
    noise: float,
    seed: int,
    draws: Sequence[int],
) -> list[tuple[Piece, ...]]:
    """Return the pieces with motions estimated from new noise, once for each draw.

    Args:
        stretches: recorded stretches, one for each piece.
        pieces: pieces with the estimated motion.
        forces: simulated forces [N], (N,) for each piece; the actuator deforms under them.
        noise: standard deviation of the noise in the recorded force [N].
        seed: seed of the noise.
        draws: numbers of the draws.
    """
    return [
        tuple(
            _resample_piece(stretch, piece, force, noise, np.random.default_rng([seed, i, draw]))
            for i, (stretch, piece, force) in enumerate(zip(stretches, pieces, forces, strict=True))
        )
        for draw in draws
    ]


def _resample_piece(
    stretch: Stretch, piece: Piece, force: Array, noise: float, random: np.random.Generator
) -> Piece:
    replica = replace(
        stretch,
        displacement=piece.excitation.displacement
        + estimate_recorded_noise(stretch) * random.standard_normal(len(force)),
        force=force + noise * random.standard_normal(len(force)),
    )
    return replace_motion(piece, replica)


def propagate_input_noise(problem: Problem, unknowns: Array, draws: Sequence[Sequence[Piece]]) -> Array:
    """Return the squared change of the simulated force [N²] for each draw, (draws, N) over all pieces in sequence.

    Args:
        problem: fitted problem with its effects.
        unknowns: unknowns (U,) of the fit.
        draws: pieces with other motions, from ``resample_motion``.
    """
    quick = problem.make_fast()
    forces = np.concatenate(quick.simulate(unknowns))
    others = (replace(quick, pieces=tuple(p.make_fast() for p in pieces)).simulate(unknowns) for pieces in draws)
    return np.stack([(np.concatenate(other) - forces) ** 2 for other in others])
