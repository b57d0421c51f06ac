"""Profile-likelihood intervals beside those of the covariance.

The covariance takes the cost for a parabola. Here one coordinate is held away from its best value while all other
unknowns are fitted again, until the cost has risen by as much as the interval allows (Venzon and Moolgavkar 1988).
Where the cost is a parabola the two agree; where it is not, this one is right, and often lopsided. The rise
allowed is that of the covariance's own interval, so that coloured misfit and noise of the motion widen both alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import COORDINATES, Coordinates
from identification.problem import COORDINATE_COUNT, Evaluation, Problem
from identification.refine import Minimum, bounded_step, refine
from identification.refine import Settings as RefineSettings
from identification.threads import one_thread
from identification.uncertainty import Covariance, coordinate_covariance

_Z95 = 1.959964
_POINTS, _STEPS = 4, 6
"""[1] places tried on each side; steps of the fit at each."""
_CLOSE = 0.03
"""[1] relative error of the width at which a side is done."""
_STIFF = 1e3
"""[1] weight with which a coordinate is held, in its deviations."""
_SETTLED = 0.02
"""[1] expected fall of the cost below which a held fit ends."""
_FARTHEST = 6.0
"""[1] of the covariance's width: farther away nothing is sought."""


@dataclass(frozen=True)
class _Held:
    """A problem with one coordinate held."""

    problem: Problem
    index: int
    target: float
    weight: float

    def evaluate(self, unknowns: Array) -> tuple[Evaluation, float]:
        """The cost with the pull towards the target, and without."""
        plain = self.problem.evaluate(unknowns)
        q = unknowns[:COORDINATE_COUNT]
        # Held by a stiff spring: a coordinate may mix two search numbers, neither of which could be fixed for it.
        off = self.problem.space.to_coordinates(q)[self.index] - self.target
        slope = np.zeros(len(unknowns))
        slope[:COORDINATE_COUNT] = self.problem.space.slopes(q)[self.index]
        pull = self.weight**2
        hessian = plain.hessian + pull * np.outer(slope, slope)
        pulled = Evaluation(plain.cost + pull * off**2, hessian, plain.gradient + pull * off * slope)
        return pulled, plain.cost


def profile_intervals(
    problem: Problem, minimum: Minimum, found: Covariance, progress: Callable[[str, float], None]
) -> dict[str, tuple[float, float]]:
    """95 % intervals of the coordinates by profile likelihood.

    Args:
        problem: as it was minimised.
        minimum: where.
        found: its covariance; coordinates without a deviation there are left out.
        progress: told which coordinate is at work.

    Returns:
        Lower and upper end by coordinate, in its unit; an end that is not reached within six times the
        covariance's width is where the search ended.
    """
    quick = problem.quicker()
    with one_thread():
        best = refine(quick, RefineSettings(restarts=0), start=minimum.unknowns)
        spread = coordinate_covariance(problem, minimum, found)
        plain = coordinate_covariance(quick, best, _plain(quick, best))
        centre = np.array(quick.space.to_coordinates(best.unknowns[:COORDINATE_COUNT]))
        value = np.array(problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT]))
        intervals = {}
        for i, name in enumerate(Coordinates._fields):
            if spread[i, i] <= 0.0 or plain[i, i] <= 0.0:
                continue
            progress(f"profile of {name}", float(np.sqrt(best.evaluation.cost / quick.samples)) * quick.noise)
            # Widths are sought on the quicker problem, the place is the fit's.
            low, high = (_end(quick, best, i, s * np.sqrt(spread[i, i]), plain[i, i]) - centre[i] for s in (-1, 1))
            quantity = COORDINATES[i]
            intervals[name] = (
                float(np.clip(value[i] + low, quantity.low, value[i])),
                float(np.clip(value[i] + high, value[i], quantity.high)),
            )
    return intervals


def _plain(problem: Problem, minimum: Minimum) -> Covariance:
    """Covariance by the curvature alone, not scaled."""
    H = minimum.evaluation.hessian
    inside = problem.inside(minimum.unknowns) & (np.diag(H) > 0)
    full = np.zeros_like(H)
    full[np.ix_(inside, inside)] = np.linalg.pinv(H[np.ix_(inside, inside)], rcond=1e-13)
    return Covariance(full, problem.free, inside, coloured=False)


def _end(problem: Problem, best: Minimum, index: int, deviation: float, plain: float) -> float:
    """Where the cost has risen by what the interval allows, on the side of the signed deviation."""
    allowed = _Z95**2 * deviation**2 / plain
    space = problem.space
    centre = space.to_coordinates(best.unknowns[:COORDINATE_COUNT])[index]
    reach, unknowns = _Z95 * deviation, best.unknowns
    for _ in range(_POINTS):
        held = _Held(problem, index, centre + reach, _STIFF / np.sqrt(plain))
        unknowns, cost = _settle(held, unknowns)
        # Its root grows straight with the distance where the cost is a parabola, so that one step mostly arrives.
        risen = np.sqrt(max(cost - best.evaluation.cost, 1e-12) / allowed)
        moved = space.to_coordinates(unknowns[:COORDINATE_COUNT])[index] - centre
        if abs(risen - 1.0) < _CLOSE or not np.isfinite(risen):
            break
        reach = float(np.clip(moved / max(risen, 0.3) / reach, 0.3, _FARTHEST) * reach)
        if abs(reach) > _FARTHEST * _Z95 * abs(deviation):
            break
    return float(centre + moved)


def _settle(held: _Held, start: Array) -> tuple[Array, float]:
    """The best unknowns with the coordinate held, and their cost without the pull."""
    unknowns, (here, cost) = start, held.evaluate(start)
    damping = 1e-8
    for _ in range(_STEPS):
        scale = np.maximum(np.diag(here.hessian), 1e-12)
        step = bounded_step(held.problem, here, held.problem.free, damping * scale, unknowns)
        gain = -float(2.0 * here.gradient @ step + step @ here.hessian @ step)
        if gain < _SETTLED:
            break
        there, other = held.evaluate(unknowns + step)
        if there.cost < here.cost:
            unknowns, here, cost = unknowns + step, there, other
            damping = max(damping / 5.0, 1e-8)
        else:
            damping = max(10.0 * damping, 1e-4)
    return unknowns, cost
