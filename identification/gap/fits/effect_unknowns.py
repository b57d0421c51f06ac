"""Unknowns of a problem with other effects; the unknowns per log follow those of the effects."""

import numpy as np

from identification.arrays import Array
from identification.fitting import EffectModel, Problem


def replace_effect_unknowns(problem: Problem, unknowns: Array, values: Array) -> Array:
    """Return unknowns (U,) with these search coordinates (P,) of the effects.

    Args:
        problem: problem with the effects.
        unknowns: unknowns of the same law and logs with any effects.
        values: search coordinates of all effects of the problem.
    """
    first_per_log = len(unknowns) - problem.layout.per_log_count
    return np.concatenate([unknowns[: problem.layout.effects.start], values, unknowns[first_per_log:]])


def insert_effect_unknowns(problem: Problem, unknowns: Array, values: Array) -> Array:
    """Return unknowns (U + P,) with the search coordinates (P,) of one more effect, after those of the problem."""
    return np.insert(unknowns, problem.layout.per_log.start, values)


def remove_effect_unknowns(problem: Problem, unknowns: Array, removed: EffectModel) -> Array:
    """Return unknowns (U - P,) without those of one effect of the problem."""
    columns = next(columns for model, columns in problem.iterate_effects() if model == removed)
    return np.delete(unknowns, columns)
