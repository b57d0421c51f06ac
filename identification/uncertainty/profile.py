"""Profile-likelihood intervals, in addition to those of the covariance.

The covariance approximates the cost by a parabola. Here one coordinate is held away from its best value while all
other unknowns are fitted again. The interval ends where the cost has risen by the allowed amount (Venzon and
Moolgavkar 1988). If the cost is a parabola, both intervals agree. If not, the profile is correct, and often
asymmetric. The allowed rise is that of the covariance's interval, so coloured misfit and input noise widen
both alike.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper import COORDINATES, Coordinates
from identification.fitting import (
    Evaluation,
    Minimum,
    OptimiserSettings,
    Problem,
    fit_output_error,
    solve_bounded_step,
)
from identification.progress import Progress
from identification.threads import use_one_thread
from identification.uncertainty.covariance import Covariance, compute_coordinate_covariance
from identification.uncertainty.interval import Z95

_MAX_POINTS, _MAX_STEPS = 4, 6
"""Largest number of points on each side of an interval, and of fit steps at each point."""
_WIDTH_TOLERANCE = 0.03
"""Relative error of the width at which a side counts as found [1]."""
_HOLD_WEIGHT = 1e3
"""Weight with which a coordinate is held, in its standard deviations [1]."""
_MIN_GAIN = 0.02
"""Threshold on the expected fall of the cost [1]: below it, a constrained fit ends."""
_MAX_WIDTH = 6.0
"""Largest width of the search over that of the covariance [1]."""


@dataclass(frozen=True)
class _ConstrainedProblem:
    """A problem with one coordinate held at a target."""

    problem: Problem
    index: int
    target: float
    weight: float

    def evaluate(self, unknowns: Array) -> tuple[Evaluation, float]:
        """Return the evaluation with the penalty on the held coordinate, and the cost without it."""
        plain = self.problem.evaluate(unknowns)
        columns = self.problem.layout.coordinates
        q = unknowns[columns]
        # A penalty, because a coordinate may mix two search coordinates: fixing either would not hold it.
        deviation = self.problem.space.to_coordinates(q)[self.index] - self.target
        slope = np.zeros(len(unknowns))
        slope[columns] = self.problem.space.differentiate(q)[self.index]
        penalty = self.weight**2
        hessian = plain.hessian + penalty * np.outer(slope, slope)
        penalised = Evaluation(
            plain.cost + penalty * deviation**2, hessian, plain.gradient + penalty * deviation * slope
        )
        return penalised, plain.cost


def compute_profile_intervals(
    problem: Problem, minimum: Minimum, covariance: Covariance, progress: Progress
) -> dict[str, tuple[float, float]]:
    """Compute 95 % intervals of the coordinates by profile likelihood.

    Args:
        problem: minimised problem.
        minimum: its minimum.
        covariance: covariance of the minimum; coordinates without a deviation there are left out.
        progress: receives the name of the coordinate and the force error [N].

    Returns:
        Lower and upper end by coordinate, in its unit. An end that is not reached within six times the width of
        the covariance is the last one that was tried.
    """
    fast = problem.make_fast()
    with use_one_thread():
        best = fit_output_error(fast, OptimiserSettings(restarts=0), start=minimum.unknowns)
        variances = compute_coordinate_covariance(problem, minimum, covariance)
        plain = compute_coordinate_covariance(fast, best, _compute_plain_covariance(fast, best))
        centre = np.array(fast.space.to_coordinates(best.unknowns[fast.layout.coordinates]))
        values = np.array(problem.space.to_coordinates(minimum.unknowns[problem.layout.coordinates]))
        intervals = {}
        for i, name in enumerate(Coordinates._fields):
            if variances[i, i] <= 0.0 or plain[i, i] <= 0.0:
                continue
            progress(f"profile of {name}", float(np.sqrt(best.evaluation.cost / fast.samples)) * fast.noise)
            # The widths come from the fast variant, the position from the fit.
            low, high = (
                _find_end(fast, best, i, side * np.sqrt(variances[i, i]), plain[i, i]) - centre[i]
                for side in (-1, 1)
            )
            quantity = COORDINATES[i]
            intervals[name] = (
                float(np.clip(values[i] + low, quantity.low, values[i])),
                float(np.clip(values[i] + high, values[i], quantity.high)),
            )
    return intervals


def _compute_plain_covariance(problem: Problem, minimum: Minimum) -> Covariance:
    """Return the covariance from the curvature alone, without scaling."""
    H = minimum.evaluation.hessian
    interior = problem.find_interior(minimum.unknowns) & (np.diag(H) > 0)
    covariance = np.zeros_like(H)
    covariance[np.ix_(interior, interior)] = np.linalg.pinv(H[np.ix_(interior, interior)], rcond=1e-13)
    return Covariance(covariance, problem.free_mask, interior, is_coloured=False)


def _find_end(problem: Problem, best: Minimum, index: int, deviation: float, plain_variance: float) -> float:
    """Return the coordinate at which the cost has risen by the allowed amount, on the deviation's side."""
    allowed = Z95**2 * deviation**2 / plain_variance
    space, columns = problem.space, problem.layout.coordinates
    centre = space.to_coordinates(best.unknowns[columns])[index]
    reach, unknowns = Z95 * deviation, best.unknowns
    for _ in range(_MAX_POINTS):
        constrained = _ConstrainedProblem(problem, index, centre + reach, _HOLD_WEIGHT / np.sqrt(plain_variance))
        unknowns, cost = _minimise_constrained(constrained, unknowns)
        # For a parabola the root of the rise is proportional to the distance, so one step usually suffices.
        rise = np.sqrt(max(cost - best.evaluation.cost, 1e-12) / allowed)
        distance = space.to_coordinates(unknowns[columns])[index] - centre
        if abs(rise - 1.0) < _WIDTH_TOLERANCE or not np.isfinite(rise):
            break
        reach = float(np.clip(distance / max(rise, 0.3) / reach, 0.3, _MAX_WIDTH) * reach)
        if abs(reach) > _MAX_WIDTH * Z95 * abs(deviation):
            break
    return float(centre + distance)


def _minimise_constrained(constrained: _ConstrainedProblem, start: Array) -> tuple[Array, float]:
    """Return the best unknowns with the coordinate held, and their cost without the penalty."""
    unknowns, (here, cost) = start, constrained.evaluate(start)
    damping = 1e-8
    for _ in range(_MAX_STEPS):
        scale = np.maximum(np.diag(here.hessian), 1e-12)
        problem = constrained.problem
        step = solve_bounded_step(problem, here, problem.free_mask, damping * scale, unknowns)
        gain = -float(2.0 * here.gradient @ step + step @ here.hessian @ step)
        if gain < _MIN_GAIN:
            break
        there, new_cost = constrained.evaluate(unknowns + step)
        if there.cost < here.cost:
            unknowns, here, cost = unknowns + step, there, new_cost
            damping = max(damping / 5.0, 1e-8)
        else:
            damping = max(10.0 * damping, 1e-4)
    return unknowns, cost
