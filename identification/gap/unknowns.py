"""Unknowns of a fit with other effects; behind the effects stands what each further log has of its own."""

import numpy as np

from identification.arrays import Array
from identification.effect_choice import EffectChoice
from identification.problem import Problem


def with_effects_at(problem: Problem, unknowns: Array, values: Array) -> Array:
    """Unknowns (U,) with the effects at these search numbers (P,).

    Args:
        problem: with the effects.
        unknowns: of the same law and logs, with whatever effects.
        values: of all of its effects.
    """
    behind = len(unknowns) - problem.own_count
    return np.concatenate([unknowns[: problem.first_effect], values, unknowns[behind:]])


def with_further(problem: Problem, unknowns: Array, values: Array) -> Array:
    """Unknowns (U + P,) with a further effect at these search numbers (P,), behind the problem's own effects."""
    return np.insert(unknowns, problem.first_own, values)


def without(problem: Problem, unknowns: Array, left_out: EffectChoice) -> Array:
    """Unknowns (U - P,) without those of one of the problem's effects."""
    at = problem.first_effect
    for choice in problem.effects:
        if choice == left_out:
            break
        at += len(choice.quantities)
    return np.delete(unknowns, slice(at, at + len(left_out.quantities)))
