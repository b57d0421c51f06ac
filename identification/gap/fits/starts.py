"""Starts of a joint fit.

A warm start can miss a large effect. Without the effect, the law's coordinates have moved to values that hide it,
and from there the effect seems small. Every start therefore begins with one joint step, and some begin at the
coordinates of the regression.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product

import numpy as np

from identification.arrays import Array
from identification.fitting import EffectModel, Problem, make_starting_points, solve_bounded_step
from identification.gap.fits.effect_unknowns import replace_effect_unknowns
from identification.gap.fits.fit_options import FitOptions
from identification.gap.fits.joint_step import STEP_FRACTIONS, StartPoint, take_joint_step

KnownValues = Mapping[EffectModel, tuple[float, ...]]
"""Values of effects from an earlier fit."""

_LAW_DAMPING = 1e-3
"""Damping of a step of the law alone, relative to the curvature of each unknown."""


def generate_starts(
    problem: Problem, start: Array | None, known: KnownValues, options: FitOptions, further: Sequence[Array]
) -> Iterator[StartPoint]:
    """Yield every start of a joint fit, each after its joint step.

    Args:
        start: unknowns (U,) of an earlier fit of the same law; None for the regression.
        known: values of effects from that fit.
        options: number and kind of starts.
        further: unknowns (U,) of the problem that are starts as well; they come first.
    """
    for u in further:
        yield take_joint_step(problem, _step_law_alone(problem, u, options.law_steps))[0]
    origins = [] if start is None else [start]
    if options.starts and (start is None or options.regression_start):
        origins.append(make_starting_points(problem.replace_effects(()))[0])
    combinations = ((u, values) for u in origins for values in _combine_starts(problem.effects, known))
    for unknowns, values in islice(combinations, options.starts):
        yield take_joint_step(problem, replace_effect_unknowns(problem, unknowns, values))[0]


def _step_law_alone(problem: Problem, unknowns: Array, steps: int) -> Array:
    """Return unknowns (U,) after some steps of the law alone.

    While the law's yield displacement is still wrong, a descent reduces backlash or compliance to zero.
    """
    free = problem.free_mask & ~problem.delay_mask
    free[problem.layout.effects] = False
    for _ in range(steps):
        here = problem.evaluate(unknowns)
        if not np.isfinite(here.cost):
            break
        scale = np.diag(here.hessian)
        damping = _LAW_DAMPING * np.maximum(scale, 1e-9 * scale.max())
        step = solve_bounded_step(problem, here, free, damping, unknowns)
        trials = (unknowns + fraction * step for fraction in STEP_FRACTIONS)
        lower = next((trial for trial in trials if problem.compute_cost(trial) < here.cost), None)
        if lower is None:
            break
        unknowns = lower
    return unknowns


def _combine_starts(effects: tuple[EffectModel, ...], known: KnownValues) -> Iterator[Array]:
    """Yield search coordinates of all effects: known values, or all combinations of the starts of their forms."""
    per_effect = [[known[e]] if e in known else list(e.starts) for e in effects]
    for chosen in product(*per_effect):
        yield np.concatenate([e.to_search(v) for e, v in zip(effects, chosen, strict=True)] or [np.empty(0)])
