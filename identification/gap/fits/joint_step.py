"""Joint step: one Gauss-Newton step in the law's coordinates and the effects together."""

from dataclasses import dataclass, field

import numpy as np

from identification.arrays import Array
from identification.fitting import Evaluation, Problem, solve_bounded_step

STEP_FRACTIONS = (1.0, 0.5, 0.2, 0.05)
"""Fractions of a step that a line search tries."""
_DAMPING = 1e-4
"""Damping of a joint step, relative to the curvature of each unknown."""
_SUFFICIENT_DECREASE = 0.7
"""Achieved part of the predicted decrease, above which no shorter step is tried."""


@dataclass(frozen=True)
class StartPoint:
    """Unknowns from which a descent can start."""

    unknowns: Array
    """(U,) unknowns of the problem with its effects."""
    cost: float = field(default=float("inf"))
    """Cost there [1]."""


def take_joint_step(problem: Problem, unknowns: Array) -> tuple[StartPoint, Evaluation, float]:
    """Take one Gauss-Newton step in all unknowns, shortened until the cost decreases.

    Returns:
        The best point, the evaluation at the given unknowns, and the cost that the full step predicts.
    """
    here = problem.evaluate(unknowns)
    step, predicted = predict_joint_step(problem, here, unknowns)
    return _search_line(problem, StartPoint(unknowns, here.cost), step, predicted), here, predicted


def _search_line(problem: Problem, start: StartPoint, step: Array, predicted: float) -> StartPoint:
    """Return the best point of a step that is shortened as long as shorter is better."""
    best = start
    for fraction in STEP_FRACTIONS:
        # The whole step is shortened: clipped by element, it would leave the direction of descent.
        there = StartPoint(
            start.unknowns + fraction * step, problem.compute_cost(start.unknowns + fraction * step)
        )
        if there.cost < best.cost:
            best = there
            if start.cost - there.cost > _SUFFICIENT_DECREASE * (start.cost - predicted):
                break
        elif best.cost < start.cost:
            break
    return best


def predict_joint_step(problem: Problem, here: Evaluation, unknowns: Array) -> tuple[Array, float]:
    """Return the Gauss-Newton step (U,) inside the bounds, with fixed delays, and the cost that it predicts.

    Where the simulation diverges, the step is zero and the cost infinite.
    """
    if not np.isfinite(here.cost):
        return np.zeros(len(unknowns)), np.inf
    free = problem.free_mask & ~problem.delay_mask
    scale = np.diag(here.hessian)
    damping = _DAMPING * np.maximum(scale, 1e-9 * scale.max())
    step = solve_bounded_step(problem, here, free, damping, unknowns)
    return step, here.cost + 2.0 * float(here.gradient @ step) + float(step @ here.hessian @ step)
