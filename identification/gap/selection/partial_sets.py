"""Partial sets: effects that reduce the error on unseen strokes, where no set of effects explains the gap.

Each candidate is compared with the law alone by block evidence on the held-out strokes. An effect that only
absorbs the form error of an unknown cause reduces the error in some blocks and increases it in others. The larger
the part of the gap that a set leaves, the less certain it is that its effects are active.

The search for the whole cause ends early, because hardly any effect brings an unknown cause near the floor. So the
most probable partial set grows here: every effect with an expected gain is fitted with it, and the growth ends
when no larger set is more probable.
"""

import math

import numpy as np

from identification.gap.data import compute_evidence, count_independent_samples
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.neighbours import find_subset, fit_extension, fit_without_effect
from identification.gap.selection.posterior import (
    Posterior,
    compute_log_prior,
    compute_misattribution,
    normalise_scores,
)
from identification.gap.selection.screening import select_shortlist

_GENUINE_PROBABILITY = 0.5
"""Probability that an effect is active if it closes a part of the gap of an unknown cause.

Otherwise it only resembles that cause.
"""


def find_partial_sets(pool: CandidatePool, posterior: Posterior) -> Posterior:
    """Return the probabilities of the fitted sets, also as parts of a cause that the library does not contain.

    ``posterior`` has the probabilities of the sets as the whole cause, and that of an unknown one. The most
    probable set grows effect by effect, and its subsets with one effect less are fitted if they are not.
    """
    best = pool.fit_most_probable_set(compute_partial_posterior)
    while len(best) < pool.settings.max_partial_effects:
        _fit_extensions(pool, best)
        grown = _prune(pool, pool.fit_most_probable_set(compute_partial_posterior))
        if len(grown) <= len(best):
            break
        best = grown
    best = pool.fit_most_probable_set(compute_partial_posterior)
    for model in pool.candidates[best].fit.effects:
        find_subset(pool, pool.candidates[best], model)
    partial, part = compute_partial_posterior(pool), _GENUINE_PROBABILITY * posterior.unknown
    sets = {n: posterior.sets.get(n, 0.0) + part * p for n, p in partial.sets.items()}
    return Posterior(sets, 1.0 - sum(sets.values()))


def _prune(pool: CandidatePool, names: frozenset[str]) -> frozenset[str]:
    """Fit a set without each of its effects, from its own end; return the set that is then most probable.

    A larger set is fitted later than the set it grew from. So an effect without influence seems to gain what the
    law has gained by the further descent.
    """
    for model in pool.candidates[names].fit.effects:
        fit_without_effect(pool, pool.candidates[names], model)
    return pool.fit_most_probable_set(compute_partial_posterior)


def _fit_extensions(pool: CandidatePool, names: frozenset[str]) -> None:
    """Fit a set with each further effect that is expected to close a part of the gap, where it is not known."""
    known = pool.candidates[names]
    for gain in select_shortlist(pool.screen(known, names), len(pool.library)):
        if names | {gain.effect_model.name} not in pool.candidates:
            fit_extension(pool, known, gain)


def compute_partial_posterior(pool: CandidatePool) -> Posterior:
    """Compute the probabilities of the fitted sets from block evidence on the held-out strokes."""
    held_out = {n: pool.comparison.select_held_out(c.residual) for n, c in pool.candidates.items()}
    before = held_out[frozenset()]
    samples = count_independent_samples(before, pool.problems.block_length)
    names = list(held_out)
    weights = {s.names: s.weight for s in pool.collect_evidence()}
    scores = np.array(
        [
            compute_log_prior(n)
            + math.log(weights[n])
            + compute_evidence(before, after, pool.problems.block_length, samples)
            for n, after in held_out.items()
        ]
    )
    shares = normalise_scores(scores)
    excess = pool.compute_excess(pool.candidates[names[int(np.argmax(scores))]])
    remaining = min(max(excess, 0.0) / max(pool.baseline_excess, 1e-12), 1.0)
    certain = 1.0 - compute_misattribution(remaining)
    sets = {n: float(s) * (certain if n else 1.0) for n, s in zip(names, shares, strict=True)}
    return Posterior(sets, 1.0 - sum(sets.values()))
