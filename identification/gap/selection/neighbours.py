"""Neighbours of a set: fits with one effect more or one effect less."""

from collections.abc import Sequence

import numpy as np

from identification.fitting import EffectModel
from identification.gap.fits import Candidate, FitOptions, remove_effect_unknowns
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.screening import ScreeningResult
from identification.gap.selection.search_settings import QUICK_FIT, SEARCH_TOLERANCE

_STAGED_FIT = FitOptions(
    decimation=1,
    starts=0,
    descents=2,
    iterations=60,
    regression_start=False,
    start_decimation=2,
    law_steps=5,
    refit_full=False,
    tolerance=SEARCH_TOLERANCE,
)
"""Two descents, each after some steps of the law alone, on decimated data.

Origin of the limit: a stiffening joint takes more than 25 steps, and a descent that stops before its end
says nothing about its form.
"""


def fit_extension(
    pool: CandidatePool, parent: Candidate, gain: ScreeningResult, values: Sequence[tuple[float, ...]] = ()
) -> Candidate:
    """Fit a set with one more effect, from the end of its screening and from further values of the effect.

    Without the effect, the law's coordinates may have moved to values that hide it. So the fit also starts at the
    coordinates of the regression.
    """
    first, start = pool.problems.decimated.layout.effects.start, parent.fit.problem.layout.per_log.start
    from_regression = np.concatenate([pool.problems.regression_start[:first], gain.unknowns[first:]])
    further = [from_regression.copy() for _ in values]
    for unknowns, tried in zip(further, values, strict=True):
        unknowns[start : start + len(tried)] = gain.effect_model.to_search(tried)
    options = _STAGED_FIT if values else QUICK_FIT
    effects = (*parent.fit.effects, gain.effect_model)
    return pool.fit(effects, [gain.unknowns, from_regression, *further], options)


def fit_without_effect(pool: CandidatePool, candidate: Candidate, removed: EffectModel) -> Candidate:
    """Fit a set without one of its effects, from the end of the whole set."""
    others = tuple(model for model in candidate.fit.effects if model != removed)
    start = remove_effect_unknowns(candidate.fit.problem, candidate.fit.minimum.unknowns, removed)
    return pool.fit(others, [start])


def find_subset(pool: CandidatePool, candidate: Candidate, removed: EffectModel) -> Candidate:
    """Return a set without one of its effects, fitted if it is not known."""
    return pool.candidates.get(candidate.names - {removed.name}) or fit_without_effect(pool, candidate, removed)
