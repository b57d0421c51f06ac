"""Output-error fit: Levenberg-Marquardt on the simulated force, started from a regression.

Steps are scaled as a whole. Unknowns that would leave their bounds are fixed at them, and the others are solved
again. If the best minimum is above the noise floor or at a bound, further starts are tried.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from identification.arrays import Array, BoolArray
from identification.fitting.budget import Budget, EffortMeter
from identification.fitting.initial_guess import draw_random_start, make_starting_points
from identification.fitting.problem import Evaluation, Problem
from identification.progress import Progress, ignore_progress
from identification.threads import use_one_thread

_MAX_STEP = 1.5
"""Largest change of a search coordinate in one step: a factor 4.5 for logarithmic ones."""
_FLOOR_RATIO = 1.03
"""Threshold on the mean squared residual over the noise variance: above it, further starts are tried."""
_SAME_COST = 1e-3
"""Threshold on the relative cost difference of two minima: below it, they are the same."""
_MIN_AGREEING = 2
"""Number of minimisations that must end in the same minimum before it counts as the lowest."""
_SCATTER_FACTOR = 3.0
"""Largest factor by which a random start changes a coordinate."""
_MIN_GAIN = 0.02
"""Threshold on the expected decrease of the cost, in noise units: below it, a minimisation ends.

A decrease of 0.02 is a seventh of a standard deviation.
"""
_PREVIEW_RATE, _PREVIEW_SAMPLES = 25.0, 10_000
"""Sampling rate [units of the recording's rate] and number of samples of the preview.

It is a cheaper minimisation on decimated samples that comes first."""
_FIRST_STAGE = 12
"""Largest number of steps in which the shape of the loop is held."""
_DELAY_RELEASE = 0.1
"""Threshold on the expected relative decrease of the cost: below it, the delays are freed."""


@dataclass(frozen=True)
class Minimum:
    """End of a minimisation."""

    unknowns: Array
    """(U,) unknowns at the minimum."""
    evaluation: Evaluation
    iterations: int
    converged: bool


@dataclass(frozen=True)
class OptimiserSettings:
    """Effort of a fit."""

    iterations: int = 60
    """Largest number of steps of one minimisation."""
    restarts: int = 4
    """Largest number of further starts after the first."""
    seed: int = 1
    """Seed of the random starts."""
    budget: Budget = field(default_factory=Budget)
    """Steps or processor time after which no further start is tried."""
    holds_shape: bool = False
    """True to hold the shape of the loop in the first steps from a given start, as from a regression."""
    tolerance: float = 0.0
    """Part of the excess over the noise that a step must be expected to remove, else a minimisation ends [1]."""


def fit_output_error(
    problem: Problem,
    settings: OptimiserSettings = OptimiserSettings(),
    progress: Progress = ignore_progress,
    start: Array | None = None,
) -> Minimum:
    """Fit the unknowns of a problem, and return the best minimum found.

    Args:
        problem: the least-squares problem.
        settings: effort of the fit.
        progress: receives every step.
        start: starting point (U,); from a regression if None.
    """
    with use_one_thread():
        return _search(problem, settings, progress, start)


def _search(problem: Problem, settings: OptimiserSettings, progress: Progress, start: Array | None) -> Minimum:
    meter = EffortMeter(settings.budget, progress)
    preview = _decimate_for_preview(problem)
    starts = make_starting_points(preview) if start is None else [start]
    is_distant = start is None or settings.holds_shape
    first = _minimise_preview(preview, starts[0], settings, meter.report) if is_distant else starts[0]
    best = minimise(problem, first, settings.iterations, meter.report, tolerance=settings.tolerance)
    agreeing = 0
    for other_start in itertools.islice(_generate_restarts(preview, starts, settings.seed), settings.restarts):
        if meter.is_spent or _is_conclusive(problem, best) or agreeing >= _MIN_AGREEING:
            break
        near = _minimise_preview(preview, other_start, settings, meter.report)
        other = minimise(problem, near, settings.iterations, meter.report, tolerance=settings.tolerance)
        change = other.evaluation.cost / best.evaluation.cost - 1.0
        agreeing += abs(change) < _SAME_COST
        if change < 0.0:
            best = other
    return best


def _is_conclusive(problem: Problem, minimum: Minimum) -> bool:
    """Return whether a minimum is at the noise floor with every coordinate within its bounds.

    A wrong minimum may reach the floor of few samples, but its coordinates then run into bounds.
    """
    coordinates = problem.layout.coordinates
    interior = problem.find_interior(minimum.unknowns)[coordinates] | ~problem.free_mask[coordinates]
    return minimum.evaluation.cost / problem.samples < _FLOOR_RATIO and bool(interior.all())


def _minimise_preview(preview: Problem, start: Array, settings: OptimiserSettings, progress: Progress) -> Array:
    """Return the unknowns (U,) of a start's minimum on the preview.

    The first steps hold the shape of the loop and the rate of the field, which cannot be found while the forces
    are wrong.
    """
    shape = np.zeros(len(start), bool)
    shape[preview.layout.coordinates] = preview.space.shape_mask
    tolerance = settings.tolerance
    near = minimise(
        preview, start, min(_FIRST_STAGE, settings.iterations), progress, held=shape, tolerance=tolerance
    )
    return minimise(preview, near.unknowns, settings.iterations, progress, tolerance=tolerance).unknowns


def _generate_restarts(problem: Problem, starts: list[Array], seed: int) -> Iterator[Array]:
    """Yield the further starts, then random ones."""
    yield from starts[1:]
    for number in itertools.count(seed):
        yield draw_random_start(problem, starts[0], _SCATTER_FACTOR, number)


def _decimate_for_preview(problem: Problem) -> Problem:
    """Return the problem on fewer samples, or the problem itself if it has few."""
    rate = max(p.excitation.rate for p in problem.pieces)
    lowest = _PREVIEW_RATE * problem.space.scales.rate
    factor = int(min(rate / lowest, problem.samples / _PREVIEW_SAMPLES))
    return problem.decimate(factor) if factor > 1 else problem


def minimise(
    problem: Problem,
    start: Array,
    iterations: int,
    progress: Progress,
    held: BoolArray | None = None,
    tolerance: float = 0.0,
) -> Minimum:
    """Minimise the cost by Levenberg-Marquardt from one start; the delays are fixed far from the minimum.

    Args:
        problem: the least-squares problem.
        start: starting point (U,).
        iterations: largest number of steps.
        progress: receives every step.
        held: (U,) True for unknowns that stay at the start; None for none.
        tolerance: part of the excess over the noise that a step must be expected to remove [1]. A search among
            sets of effects compares excesses, so it needs none of the digits of a final fit.
    """
    unknowns, here = start, problem.evaluate(start)
    damping, scale = 1e-2, np.zeros(len(start))
    allowed = problem.free_mask if held is None else problem.free_mask & ~held
    free = allowed & ~problem.delay_mask
    for iteration in range(iterations):
        # Largest curvature so far (Moré 1978): it bounds the step of an unknown that has lost its influence.
        scale = np.maximum(scale, np.diag(here.hessian))
        step = solve_bounded_step(problem, here, free, damping * np.maximum(scale, 1e-12 * scale.max()), unknowns)
        gain = -float(2.0 * here.gradient @ step + step @ here.hessian @ step)
        small = max(_MIN_GAIN * max(1.0, here.cost / problem.samples), tolerance * (here.cost - problem.samples))
        if gain < (small if free[problem.delay_mask].any() else _DELAY_RELEASE * here.cost):
            if (free == allowed).all():
                return Minimum(unknowns, here, iteration, converged=True)
            free = allowed
            continue
        there = problem.evaluate(unknowns + step)
        if there.cost < here.cost:
            unknowns, here = unknowns + step, there
            damping = max(damping / 5.0, 1e-9)
            progress("refine", problem.noise * float(np.sqrt(here.cost / problem.samples)))
        # The remaining gain may be smaller than the jump of the cost between two step counts (decision 0003).
        elif gain < 100.0 * small or damping > 1e8:
            return Minimum(unknowns, here, iteration, converged=True)
        else:
            damping *= 6.0
    return Minimum(unknowns, here, iterations, converged=False)


def solve_bounded_step(
    problem: Problem, here: Evaluation, free: BoolArray, damping: Array, unknowns: Array
) -> Array:
    """Return the damped Gauss-Newton step (U,) within the bounds, scaled to the largest allowed length.

    The step is zero where the simulation diverges, since such a point has no derivatives.
    """
    low, high = problem.get_bounds()
    step, moving = np.zeros(len(unknowns)), free.copy()
    if not np.isfinite(here.hessian).all():
        return step
    for _ in range(len(unknowns)):
        fixed = here.hessian[np.ix_(moving, ~moving)] @ step[~moving]
        matrix = here.hessian[np.ix_(moving, moving)] + np.diag(damping[moving])
        step[moving] = np.linalg.solve(matrix, -here.gradient[moving] - fixed)
        longest = problem.measure_step(step)
        if longest > _MAX_STEP:
            step *= _MAX_STEP / longest
        outside = moving & ((unknowns + step < low) | (unknowns + step > high))
        if not outside.any():
            break
        step[outside] = np.clip(unknowns + step, low, high)[outside] - unknowns[outside]
        moving &= ~outside
    return step
