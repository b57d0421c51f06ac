"""What the noise of displacement and drive does to the fit.

The motion that the simulation is fed was estimated from a noisy displacement, and what is wrong with it moves
the yield displacement and the shape as much as the force noise does. The drive is measured, too: the mean of a
level that lasts two seconds is wrong by a thirtieth of its noise, and moves the yield force as much as a hundredth
of a newton. So the noise is played again: the fitted motion and the drive get fresh noise, are estimated anew in
the same way, and the change of the simulated force is carried on to the unknowns by one Gauss-Newton step (a
parametric bootstrap, linearised).

The slopes are those of the wrong motion as well, and what is wrong with both pulls the fit to one side, as noise
on the abscissa flattens a straight line (errors in variables; Carroll et al. 2006). The same replays tell by how
much: a step with the slopes of the replayed motion less one with those of the fitted motion. That is taken back.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from identification.arrays import Array, BoolArray
from identification.drive import drive_noise, steady_levels
from identification.motion import estimate_motion, recorded_noise
from identification.piece import Piece
from identification.problem import Problem
from identification.recordings import Stretch
from identification.refine import Minimum

DRAWS = 12
"""Times the noise is played again."""
_FEW = (float(stdtrit(DRAWS, 0.975)) / 1.959964) ** 2
"""[1] So few draws know their own spread to a fifth only; the factor gives 95 % intervals Student's width."""


def with_motion(piece: Piece, stretch: Stretch, cutoff: Array | None = None) -> Piece:
    """A piece whose motion and drive are those estimated from a stretch; all else stays.

    Args:
        piece: any.
        stretch: the recording behind it, or one like it.
        cutoff: (N,) of the motion's smoother [Hz], where it is known already.
    """
    x, v, a = estimate_motion(stretch, cutoff)[:3]
    drive = steady_levels(stretch.drive)
    stroke = replace(piece.stroke, rate=stretch.rate, displacement=x, velocity=v, acceleration=a, drive=drive)
    return replace(piece, stroke=stroke)


@dataclass(frozen=True)
class Played:
    """What noise of motion and drive does to the unknowns."""

    scatter: Array
    """(U, U) second moment of their errors."""
    pull: Array
    """(U,) mean error that they have because the slopes come from the same wrong motion."""


def play_noise(problem: Problem, stretches: Sequence[Stretch], minimum: Minimum, seed: int) -> Played:
    """Play the noise of motion and drive again.

    Args:
        problem: with one piece for each of the stretches, in their order.
        stretches: the recordings behind the pieces.
        minimum: where the fit ended.
        seed: of the noise.
    """
    fitted = _as_fitted(problem.quicker(), minimum.unknowns)
    inside = fitted.inside(minimum.unknowns)
    slopes = [fitted.residuals(minimum.unknowns, i)[1] for i in range(len(fitted.pieces))]
    played = [replace(s, force=p.force) for s, p in zip(stretches, fitted.pieces, strict=True)]
    # The fitted motion is smoother than the real one: a cutoff chosen anew would pass less noise than it did.
    cutoffs = [estimate_motion(s).cutoff for s in played]
    plain, own = np.zeros((2, DRAWS, len(inside)))
    for draw in range(DRAWS):
        wrong = replace(fitted, pieces=tuple(_replayed(fitted, played, cutoffs, [seed, draw])))
        plain[draw, inside], own[draw, inside] = _steps(wrong, minimum, slopes, inside)
    return Played(np.asarray(_FEW * (plain.T @ plain) / DRAWS), (own - plain).mean(axis=0))


def _steps(wrong: Problem, minimum: Minimum, slopes: Sequence[Array], inside: BoolArray) -> tuple[Array, Array]:
    """Steps that a wrong motion causes: with the slopes of the fitted motion, and with its own."""
    H, gradients = minimum.evaluation.hessian.copy(), np.zeros((2, len(inside)))
    for i, J in enumerate(slopes):
        r, own = wrong.residuals(minimum.unknowns, i)
        places = wrong.columns(i)
        gradients[0, places] += J.T @ r
        gradients[1, places] += own.T @ r
        # The fit's own information, priors too, with the replayed motion's rows for those of the fitted one.
        H[np.ix_(places, places)] += own.T @ own - J.T @ J
    free = np.ix_(inside, inside)
    plain = np.linalg.solve(minimum.evaluation.hessian[free], -gradients[0, inside])
    return plain, np.linalg.solve(H[free], -gradients[1, inside])


def without_pull(problem: Problem, minimum: Minimum, pull: Array) -> Minimum:
    """A minimum with the pull (U,) of a wrong motion taken back."""
    unknowns = np.clip(minimum.unknowns - pull, *problem.bounds())
    return replace(minimum, unknowns=unknowns, evaluation=problem.evaluate(unknowns))


def _as_fitted(problem: Problem, unknowns: Array) -> Problem:
    """The problem with its own simulated force for the recorded one."""
    forces = problem.simulate(unknowns)
    return replace(problem, pieces=tuple(replace(p, force=f) for p, f in zip(problem.pieces, forces, strict=True)))


def _replayed(
    problem: Problem, stretches: Sequence[Stretch], cutoffs: Sequence[Array], seed: Sequence[int]
) -> Iterator[Piece]:
    """The pieces with motion and drive estimated from fresh noise upon them."""
    for i, (piece, stretch, cutoff) in enumerate(zip(problem.pieces, stretches, cutoffs, strict=True)):
        random = np.random.default_rng([*seed, i])
        count, s = len(piece.force), piece.stroke
        noisy = replace(
            stretch,
            displacement=s.displacement + recorded_noise(stretch) * random.standard_normal(count),
            drive=s.drive + _level_noise(stretch.drive) * random.standard_normal(count),
        )
        yield with_motion(piece, noisy, cutoff)


def _level_noise(drive: Array) -> Array:
    """Standard deviation (N,) [V or A] of the drive's noise where it stands still.

    A drive that moves goes into the simulation as it was measured: its noise is in the fit already.
    """
    still = steady_levels(drive) != drive
    return np.where(still, drive_noise(drive), 0.0)
