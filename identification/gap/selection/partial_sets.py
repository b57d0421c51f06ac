"""Partial sets: effects that reduce the error on unseen strokes, where no set of effects explains the gap.

Each candidate is compared with the law alone by block evidence on the held-out strokes. An effect that only takes
up the form error of an unknown cause reduces the error in some blocks and increases it in others. The larger the
part of the gap that a set leaves, the less certain it is that its effects are at work.
"""

import math

import numpy as np

from identification.gap.selection.block_evidence import compute_evidence
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.neighbours import find_subset
from identification.gap.selection.posterior import (
    Posterior,
    compute_log_prior,
    compute_misattribution,
    normalise_scores,
)

_GENUINE_PROBABILITY = 0.5
"""Probability that an effect which closes a part of the gap of an unknown cause is at work, and no look-alike."""


def find_partial_sets(pool: CandidatePool, posterior: Posterior) -> Posterior:
    """Return the probabilities of the fitted sets, also as parts of a cause that the library does not contain.

    ``posterior`` has the probabilities of the sets as the whole cause, and that of an unknown one.
    The most probable set, and its subsets with one effect less, are fitted if they are not.
    """
    for _ in range(pool.settings.max_refits):
        partial = compute_partial_posterior(pool)
        best = partial.rank_sets()[0][0]
        if best in pool.full_fits:
            break
        pool.fit_fully(best)
    for model in pool.candidates[best].fit.effects:
        find_subset(pool, pool.candidates[best], model)
    partial, part = compute_partial_posterior(pool), _GENUINE_PROBABILITY * posterior.unknown
    sets = {n: posterior.sets.get(n, 0.0) + part * p for n, p in partial.sets.items()}
    return Posterior(sets, 1.0 - sum(sets.values()))


def compute_partial_posterior(pool: CandidatePool) -> Posterior:
    """Compute the probabilities of the fitted sets from block evidence on the held-out strokes."""
    before = pool.select_held_out(frozenset())
    names = list(pool.candidates)
    weights = {s.names: s.weight for s in pool.collect_evidence()}
    scores = np.array(
        [
            compute_log_prior(n)
            + math.log(weights[n])
            + compute_evidence(before, pool.select_held_out(n), pool.block_length)
            for n in names
        ]
    )
    shares = normalise_scores(scores)
    excess = pool.compute_excess(pool.candidates[names[int(np.argmax(scores))]])
    remaining = min(max(excess, 0.0) / max(pool.baseline_excess, 1e-12), 1.0)
    certain = 1.0 - compute_misattribution(remaining)
    sets = {n: float(s) * (certain if n else 1.0) for n, s in zip(names, shares, strict=True)}
    return Posterior(sets, 1.0 - sum(sets.values()))
