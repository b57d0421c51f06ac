"""Output-error fit: Levenberg-Marquardt on the simulated force, started from a regression.

Steps are shrunk whole, never element by element, and unknowns that would leave their bounds are set onto them
while the others are solved again. If the best point stays above the noise floor, scattered starts are tried.
"""

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.problem import Evaluation, Problem
from identification.start import further_points, scattered, starting_points
from identification.threads import one_thread

_LARGEST_STEP = 1.5
"""[1] largest change of a search number in one step: a factor 4.5 for the logarithmic ones."""
_FLOOR_RATIO = 1.03
"""[1] mean squared residual over the noise's above which other starts are tried."""
_SAME_COST = 1e-3
"""[1] relative difference below which two minima count as one."""
_AGREED = 2
"""Descents that must end in the same minimum before it is taken for the lowest."""
_SCATTER = 3.0
_NO_GAIN = 0.02
"""[1] expected fall of the cost, in its own noise units, below which a descent ends: a seventh of a deviation."""
_LOOK_RATE, _LOOK_SAMPLES = 250.0, 10_000
"""[Hz] and samples that a first look keeps: it finds the way, and a step on all samples costs several of its."""
_NEAR = 0.1
"""[1] expected relative fall of the cost below which the delays are freed too."""

Progress = Callable[[str, float], None]
"""Told what is being done and the force error so far [N]."""


@dataclass(frozen=True)
class Minimum:
    """Where a descent ended."""

    unknowns: Array
    """(U,)"""
    evaluation: Evaluation
    iterations: int
    converged: bool


@dataclass(frozen=True)
class Settings:
    """How hard to try."""

    iterations: int = 60
    """Most steps in one descent."""
    restarts: int = 4
    """Most scattered starts after the regression's own."""
    seed: int = 1
    """Of the scatter."""
    budget: float | None = None
    """[s] of processor time after which no further start is tried."""


def refine(
    problem: Problem,
    settings: Settings = Settings(),
    progress: Progress = lambda what, error: None,
    start: Array | None = None,
) -> Minimum:
    """The best minimum found.

    Args:
        problem: what is minimised.
        settings: how hard to try.
        progress: told of every step.
        start: unknowns (U,) to begin with; the regression's if None.
    """
    with one_thread():
        return _search(problem, settings, progress, start)


def _search(problem: Problem, settings: Settings, progress: Progress, start: Array | None) -> Minimum:
    began = time.process_time()
    look = _first_look(problem)
    starts = starting_points(look) if start is None else [start]
    first = starts[0]
    if start is None and look is not problem:
        first = descend(look, first, settings.iterations, progress).unknowns
    best = descend(problem, first, settings.iterations, progress)
    others, agreed = _others(look, starts, settings.seed), 0
    for _ in range(settings.restarts):
        late = settings.budget is not None and time.process_time() - began > settings.budget
        if late or agreed >= _AGREED or best.evaluation.cost / problem.samples < _FLOOR_RATIO:
            break
        other = descend(problem, next(others), settings.iterations, progress)
        change = other.evaluation.cost / best.evaluation.cost - 1.0
        agreed += abs(change) < _SAME_COST
        if change < 0.0:
            best = other
    return best


def _others(problem: Problem, starts: list[Array], seed: int) -> Iterator[Array]:
    """Further starts: of the other kind and of the same by turns, then scattered ones."""
    if len(starts) > 1:
        further = further_points(problem)
        yield further[0]
        for pair in zip(starts[1:], further[1:], strict=True):
            yield from pair
    for number in itertools.count(seed):
        yield scattered(problem, starts[0], _SCATTER, number)


def _first_look(problem: Problem) -> Problem:
    """The problem on fewer samples; itself where it has few."""
    rate = max(p.stroke.rate for p in problem.pieces)
    times = int(min(rate / _LOOK_RATE, problem.samples / _LOOK_SAMPLES))
    return problem.coarser(times) if times > 1 else problem


def descend(problem: Problem, start: Array, iterations: int, progress: Progress) -> Minimum:
    """Levenberg-Marquardt from one start; the delays wait until the coordinates have come near."""
    unknowns, here = start, problem.evaluate(start)
    damping, scale = 1e-2, np.zeros(len(start))
    free = problem.free & ~problem.delays
    for iteration in range(iterations):
        # The largest curvature met so far (Moré 1978): an unknown that no longer shows is not flung away.
        scale = np.maximum(scale, np.diag(here.hessian))
        step = bounded_step(problem, here, free, damping * np.maximum(scale, 1e-12 * scale.max()), unknowns)
        gain = -float(2.0 * here.gradient @ step + step @ here.hessian @ step)
        small = _NO_GAIN * max(1.0, here.cost / problem.samples)
        if gain < (small if free[problem.delays].any() else _NEAR * here.cost):
            if (free == problem.free).all():
                return Minimum(unknowns, here, iteration, converged=True)
            free = problem.free
            continue
        there = problem.evaluate(unknowns + step)
        if there.cost < here.cost:
            unknowns, here = unknowns + step, there
            damping = max(damping / 5.0, 1e-9)
            progress("refine", problem.noise * float(np.sqrt(here.cost / problem.samples)))
        # So little is left to gain that jumps between two plans of steps may outweigh it (decision 0003).
        elif gain < 100.0 * small or damping > 1e8:
            return Minimum(unknowns, here, iteration, converged=True)
        else:
            damping *= 6.0
    return Minimum(unknowns, here, iterations, converged=False)


def bounded_step(problem: Problem, here: Evaluation, free: BoolArray, damping: Array, unknowns: Array) -> Array:
    """The damped Gauss-Newton step (U,) inside the bounds, shrunk whole to a sensible length."""
    low, high = problem.bounds()
    step, moving = np.zeros(len(unknowns)), free.copy()
    for _ in range(len(unknowns)):
        pinned = here.hessian[np.ix_(moving, ~moving)] @ step[~moving]
        matrix = here.hessian[np.ix_(moving, moving)] + np.diag(damping[moving])
        step[moving] = np.linalg.solve(matrix, -here.gradient[moving] - pinned)
        longest = problem.step_length(step)
        if longest > _LARGEST_STEP:
            step *= _LARGEST_STEP / longest
        outside = moving & ((unknowns + step < low) | (unknowns + step > high))
        if not outside.any():
            break
        step[outside] = np.clip(unknowns + step, low, high)[outside] - unknowns[outside]
        moving &= ~outside
    return step
