"""Effect of input noise, the noise of displacement and drive, on the fit.

The motion that drives the simulation is estimated from a noisy displacement. Its error changes the yield
displacement and the shape as much as the force noise does. The drive is measured as well. The mean of a level that
lasts two seconds has a thirtieth of the drive's noise. It changes the yield force by a hundredth of a newton. The
noise is therefore resampled. The fitted motion and the drive get fresh noise and are estimated again in the same
way. The change of the simulated force is propagated to the unknowns by one Gauss-Newton step (linearised
parametric bootstrap).

The sensitivities are computed along the erroneous motion as well. This correlation biases the fit, as noise on the
abscissa flattens a straight line (errors in variables; Carroll et al. 2006). The same replicas show the bias: a
step with the sensitivities of the replica's motion less one with those of the fitted motion. It is subtracted.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from identification.arrays import Array, BoolArray
from identification.fitting import Minimum, Piece, Problem
from identification.logs import Stretch
from identification.signals import (
    Motion,
    average_drive_levels,
    estimate_drive_noise,
    estimate_motion,
    estimate_recorded_noise,
)
from identification.uncertainty.interval import Z95

REPLICAS = 12
"""Number of replicas with fresh input noise."""
_STUDENT_FACTOR = (float(stdtrit(REPLICAS, 0.975)) / Z95) ** 2
"""Factor on the variance [1] that gives 95 % intervals Student's width.

The standard deviation of so few replicas is itself only known to a fifth.
"""


def replace_motion(piece: Piece, stretch: Stretch, similar: Motion | None = None) -> Piece:
    """Return a piece with the motion and drive that are estimated from a stretch.

    Args:
        piece: any piece.
        stretch: the recording of the piece, or a similar one.
        similar: motion of a similar recording, whose cutoffs are taken.
    """
    x, v, a = estimate_motion(stretch, similar)[:3]
    drive = average_drive_levels(stretch.drive)
    if piece.step_shifts is not None:
        drive = piece.step_shifts.apply(drive)
    stroke = replace(piece.excitation, rate=stretch.rate, displacement=x, velocity=v, acceleration=a, drive=drive)
    return replace(piece, excitation=stroke)


def reestimate_motion(problem: Problem, stretches: Sequence[Stretch], forces: Sequence[Array]) -> Problem:
    """Return the problem with every motion estimated again, with the actuator's compliance under given forces.

    The recorded force would add its noise to the motion, and noise that both have in common biases a fit.

    Args:
        problem: problem with one piece for each stretch, in the same order.
        stretches: recordings of the pieces.
        forces: simulated force (N,) [N] of each piece.
    """
    pieces = [
        replace_motion(piece, replace(stretch, force=force))
        for piece, stretch, force in zip(problem.pieces, stretches, forces, strict=True)
    ]
    return replace(problem, pieces=tuple(pieces))


@dataclass(frozen=True)
class InputNoiseStatistics:
    """Errors of the unknowns that input noise causes."""

    scatter: Array
    """(U, U) second moment of the errors."""
    bias: Array
    """(U,) mean error, caused by sensitivities along the same erroneous motion."""


def resample_input_noise(
    problem: Problem, stretches: Sequence[Stretch], minimum: Minimum, seed: int
) -> InputNoiseStatistics:
    """Estimate the errors at a minimum that input noise causes, from replicas with fresh noise.

    The problem has one piece for each stretch, in the same order.
    """
    fitted = _replace_recorded_force(problem.make_fast(), minimum.unknowns)
    interior = fitted.find_interior(minimum.unknowns)
    sensitivities = [fitted.compute_residuals(minimum.unknowns, i)[1] for i in range(len(fitted.pieces))]
    simulated = [replace(s, force=p.force) for s, p in zip(stretches, fitted.pieces, strict=True)]
    # The fitted motion is smoother than the real one: a cutoff chosen from it would pass less noise.
    motions = [estimate_motion(s) for s in simulated]
    plain, biased = np.zeros((2, REPLICAS, len(interior)))
    for number in range(REPLICAS):
        pieces = _draw_replica(fitted, simulated, motions, [seed, number])
        replica = replace(fitted, pieces=tuple(_limit_drive(fitted, minimum.unknowns, p) for p in pieces))
        plain[number, interior], biased[number, interior] = _solve_steps(replica, minimum, sensitivities, interior)
    scatter = np.asarray(_STUDENT_FACTOR * (plain.T @ plain) / REPLICAS)
    return InputNoiseStatistics(scatter, (biased - plain).mean(axis=0))


def _solve_steps(
    replica: Problem, minimum: Minimum, sensitivities: Sequence[Array], interior: BoolArray
) -> tuple[Array, Array]:
    """Return the steps that a replica causes: with sensitivities of the fitted motion, and with its own."""
    H, gradients = minimum.evaluation.hessian.copy(), np.zeros((2, len(interior)))
    for i, J in enumerate(sensitivities):
        r, replica_J = replica.compute_residuals(minimum.unknowns, i)
        columns = replica.find_columns(i)
        gradients[0, columns] += J.T @ r
        gradients[1, columns] += replica_J.T @ r
        # The fit's information, priors included, with the replica's sensitivities in place of the fit's.
        H[np.ix_(columns, columns)] += replica_J.T @ replica_J - J.T @ J
    free = np.ix_(interior, interior)
    plain = np.linalg.solve(minimum.evaluation.hessian[free], -gradients[0, interior])
    return plain, np.linalg.solve(H[free], -gradients[1, interior])


def remove_bias(problem: Problem, minimum: Minimum, bias: Array) -> Minimum:
    """Return a minimum with the bias (U,) of input noise subtracted."""
    unknowns = np.clip(minimum.unknowns - bias, *problem.get_bounds())
    return replace(minimum, unknowns=unknowns, evaluation=problem.evaluate(unknowns))


def _replace_recorded_force(problem: Problem, unknowns: Array) -> Problem:
    """Return the problem with its own simulated force in place of the recorded one."""
    # Without a residual at the minimum, the fresh noise of a replica alone moves the unknowns.
    forces = problem.simulate(unknowns)
    return replace(problem, pieces=tuple(replace(p, force=f) for p, f in zip(problem.pieces, forces, strict=True)))


def _draw_replica(
    problem: Problem, stretches: Sequence[Stretch], motions: Sequence[Motion], seed: Sequence[int]
) -> Iterator[Piece]:
    """Yield the pieces with motion and drive estimated from fresh noise on them."""
    for i, (piece, stretch, motion) in enumerate(zip(problem.pieces, stretches, motions, strict=True)):
        random = np.random.default_rng([*seed, i])
        count, s = len(piece.force), piece.excitation
        noisy = replace(
            stretch,
            displacement=s.displacement + estimate_recorded_noise(stretch) * random.standard_normal(count),
            drive=s.drive + _estimate_level_noise(stretch.drive) * random.standard_normal(count),
        )
        yield replace_motion(piece, noisy, motion)


def _limit_drive(problem: Problem, unknowns: Array, piece: Piece) -> Piece:
    """Return a piece whose drive stays within the recorded range where a coefficient of the law is not positive.

    The bounds of a fit keep yield force and damping positive in this range only. A little beyond it, a negative
    damping would let the simulation diverge.
    """
    c, drive = problem.space.to_coordinates(unknowns[problem.layout.coordinates]), piece.excitation.drive
    lines = ((c.F_a, c.F_b), (c.c0_a, c.c0_b), (c.c1_a, c.c1_b))
    negative = np.any([at_zero + slope * drive <= 0.0 for at_zero, slope in lines], axis=0)
    inside = np.clip(drive, problem.space.lowest_drive, problem.space.highest_drive)
    return replace(piece, excitation=replace(piece.excitation, drive=np.where(negative, inside, drive)))


def _estimate_level_noise(drive: Array) -> Array:
    """Return the standard deviation (N,) [V or A] of the drive's noise, on constant levels only.

    A changing drive enters the simulation as it was measured, so the fit already contains its noise.
    """
    constant = average_drive_levels(drive) != drive
    return np.where(constant, estimate_drive_noise(drive), 0.0)
