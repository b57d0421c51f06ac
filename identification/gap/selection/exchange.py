"""Exchange: the best sets without each of their effects, and with others in its place.

A forward search keeps the effect that came first, even if it was only chosen because two others together look
like it. Of backlash and compliance it keeps the one that it tried first. A second effect may also seem to gain
only because the search for the first one had stopped early.
"""

from identification.fitting import EffectModel
from identification.gap.fits import Candidate
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.mounting import fit_mounting
from identification.gap.selection.neighbours import find_subset, fit_extension, fit_without_effect
from identification.gap.selection.screening import MOUNTING_EFFECTS, select_shortlist


def fit_subsets(pool: CandidatePool) -> None:
    """Fit the best sets of several effects without each of their effects."""
    sets = sorted((c for c in pool.candidates.values() if len(c.names) > 1), key=pool.compute_excess)
    for candidate in sets[: pool.settings.pruned_sets]:
        for model in candidate.fit.effects:
            fit_without_effect(pool, candidate, model)


def exchange_effects(pool: CandidatePool) -> None:
    """Fit other effects in place of each effect of the best set, while its excess is not negligible."""
    for _ in range(pool.settings.exchange_rounds):
        best = pool.find_best()
        if len(best.names) < 2 or pool.is_at_floor(best):
            return
        before = pool.compute_excess(best)
        for model in best.fit.effects:
            if pool.budget_spent:
                return
            _replace_effect(pool, best, model)
        if pool.compute_excess(pool.find_best()) > pool.settings.exchange_share * before:
            return


def exchange_mounting(pool: CandidatePool, names: frozenset[str]) -> None:
    """Fit backlash in place of compliance in a set of several effects, or the reverse, on all samples.

    Screening predicts no gain of either, and each can absorb most of the other. The one in the set may only have
    been tried first.
    """
    for present, other in (MOUNTING_EFFECTS, MOUNTING_EFFECTS[::-1]):
        exchanged = names - {present} | {other}
        if present not in names or other in names or len(names) < 2 or exchanged in pool.full_fits:
            continue
        known = pool.candidates[names]
        model = next(m for m in known.fit.effects if m.name == present)
        subset = find_subset(pool, known, model)
        fit_mounting(pool, subset, pool.screen(subset, names), other)
        if exchanged in pool.candidates:
            pool.fit_fully(exchanged)


def _replace_effect(pool: CandidatePool, best: Candidate, model: EffectModel) -> None:
    """Fit the effects with the largest expected gains in place of one."""
    subset = find_subset(pool, best, model)
    gains = pool.screen(subset, best.names)
    for gain in select_shortlist(gains, pool.settings.exchange_effects):
        if subset.names | {gain.effect_model.name} not in pool.candidates:
            fit_extension(pool, subset, gain)
