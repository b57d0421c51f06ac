"""What the noise of displacement and drive adds to the uncertainty of the fit.

The motion that the simulation is fed was estimated from a noisy displacement, and what is wrong with it moves
the yield displacement and the shape as much as the force noise does. The drive is measured, too: the mean of a
level that lasts two seconds is wrong by a thirtieth of its noise, and moves the yield force as much as a hundredth
of a newton. So the noise is played again: the fitted motion and the drive get fresh noise, are estimated anew in
the same way, and the change of the simulated force is carried on to the unknowns by one Gauss-Newton step (a
parametric bootstrap, linearised).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from identification.arrays import Array
from identification.drive import drive_noise, steady_levels
from identification.motion import estimate_motion, recorded_noise
from identification.problem import Piece, Problem
from identification.recordings import Stretch
from identification.refine import Minimum
from identification.simulate import Stroke

DRAWS = 12
"""Times the noise is played again."""
_FEW = (float(stdtrit(DRAWS, 0.975)) / 1.959964) ** 2
"""[1] So few draws know their own spread to a fifth only; the factor gives 95 % intervals Student's width."""


def with_motion(piece: Piece, stretch: Stretch) -> Piece:
    """A piece whose motion and drive are those estimated from a stretch; all else stays."""
    motion = estimate_motion(stretch)
    drive = steady_levels(stretch.drive)
    stroke = Stroke(stretch.rate, motion.displacement, motion.velocity, motion.acceleration, drive)
    return replace(piece, stroke=stroke)


def motion_scatter(problem: Problem, stretches: Sequence[Stretch], minimum: Minimum, seed: int) -> Array:
    """Second moment (U, U) of the unknowns' errors that noise of motion and drive causes, bias included.

    Args:
        problem: with one piece for each of the stretches, in their order.
        stretches: the recordings behind the pieces.
        minimum: where the fit ended.
        seed: of the noise.
    """
    problem = problem.quicker()
    low, high = problem.bounds()
    inside = problem.free & (minimum.unknowns > low + 1e-9) & (minimum.unknowns < high - 1e-9)
    shifts = np.zeros((DRAWS, len(minimum.unknowns)))
    for i, stretch in enumerate(stretches):
        piece = problem.piece(minimum.unknowns, i)
        _, J = problem.residuals(minimum.unknowns, i)
        setting = problem.setting(minimum.unknowns, i)
        force, _ = piece.recorded(setting)
        spread = recorded_noise(stretch)
        unsteady = _level_noise(stretch.drive)
        for draw in range(DRAWS):
            random = np.random.default_rng([seed, i, draw])
            played = replace(
                stretch,
                displacement=piece.stroke.displacement + spread * random.standard_normal(len(force)),
                drive=piece.stroke.drive + unsteady * random.standard_normal(len(force)),
                force=force + problem.noise * random.standard_normal(len(force)),
            )
            change = with_motion(piece, played).recorded(setting)[0] - force
            shifts[draw, problem.columns(i)] -= J.T @ (change * piece.train / problem.noise)
    steps = np.zeros_like(shifts)
    steps[:, inside] = np.linalg.solve(minimum.evaluation.hessian[np.ix_(inside, inside)], shifts[:, inside].T).T
    return np.asarray(_FEW * (steps.T @ steps) / DRAWS)


def _level_noise(drive: Array) -> Array:
    """Standard deviation (N,) [V or A] of the drive's noise where it stands still.

    A drive that moves goes into the simulation as it was measured: its noise is in the fit already.
    """
    still = steady_levels(drive) != drive
    return np.where(still, drive_noise(drive), 0.0)
