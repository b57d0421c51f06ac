"""Order in which sets of effects are fitted to a recording.

The search goes forward. Every effect is screened, and those with the largest expected gains are fitted together
with the law. The best sets grow by a second and a third effect. Then each effect of a set is left out once, and
others are tried in its place. All of this uses decimated data. Finally the most probable sets are fitted on all
samples.
"""

import numpy as np

from identification.fitting import EffectModel
from identification.gap.fits import Candidate, replace_effect_unknowns
from identification.gap.noise import (
    describe_drift_explanation,
    discard_unsteady_cycles,
    subtract_clock_drift,
)
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.exchange import exchange_effects, exchange_mounting, fit_subsets
from identification.gap.selection.extension import (
    check_effects,
    is_dominant,
    is_extension_promising,
    try_extension,
)
from identification.gap.selection.mounting import fit_mounting, is_mounting_promising
from identification.gap.selection.neighbours import fit_extension
from identification.gap.selection.posterior import (
    MAX_TIED_SETS,
    MIN_TIED_PROBABILITY,
    UNKNOWN_THRESHOLD,
    BlockEvidence,
    Posterior,
)
from identification.gap.selection.screening import (
    MOUNTING_EFFECTS,
    compute_expected_gain,
    list_effect_models,
    select_best_forms,
    select_shortlist,
)

_CONTACT_ACTIONS = ("connection", "displacement_backlash")
"""Actions that need starts at several sizes, so that a search from one size of the effect finds nothing."""


def search_forward(pool: CandidatePool) -> None:
    """Fit the sets of effects with the largest expected gains, on decimated data."""
    baseline = pool.fit_law()
    if pool.place_drive_steps(baseline):
        baseline = pool.fit((), [baseline.fit.minimum.unknowns])
    pool.noise_model.update(baseline, pool.problems.full, pool.evaluation)
    pool.noise_model.narrow_floor(baseline, pool.evaluation)
    if _is_noise(pool, baseline) and not _fit_certain_effects(pool):
        return
    if _is_explained_by_clocks(pool):
        return
    beam = [baseline]
    for size, count in enumerate(pool.settings.shortlist_sizes, 1):
        if pool.budget_spent or _is_explained(pool, beam[0]):
            break
        for parent in beam:
            _fit_extensions(pool, parent, count)
        if size == 1 and not _closes_enough(pool, pool.find_best(), beam[0]):
            _fit_other_effects(pool)
        _search_best_sets(pool, size)
        _refit_law(pool)
        sets = _sort_sets(pool, size)
        beam = _select_beam(pool, size, sets, beam[0])
        if not beam:
            break
    fit_subsets(pool)
    exchange_effects(pool)


def _refit_law(pool: CandidatePool) -> None:
    """Fit the law alone from the law of the best set.

    Where the first fit of the law ended in a wrong minimum, an effect may have led to the right one.
    """
    best = pool.find_best()
    if best.names and not pool.budget_spent:
        _fit_law_from(pool, best)


def _fit_law_from(pool: CandidatePool, candidate: Candidate) -> None:
    """Fit the law alone from the law of a set."""
    pool.fit((), [replace_effect_unknowns(candidate.fit.problem, candidate.fit.minimum.unknowns, np.empty(0))])


def _sort_sets(pool: CandidatePool, size: int) -> list[Candidate]:
    """Return the fitted sets of one size, the best first."""
    return sorted((c for n, c in pool.candidates.items() if len(n) == size), key=pool.compute_excess)


def _search_best_sets(pool: CandidatePool, size: int) -> None:
    """Search the best sets of one size from the starts of the law, until one is at the floor.

    A single effect is searched in all its forms.
    """
    scale = pool.problems.full.space.scales.damper_size
    for candidate in _sort_sets(pool, size)[: pool.settings.searched_sets]:
        choices: list[tuple[EffectModel, ...]] = [candidate.fit.effects]
        if size == 1:
            choices = [(model,) for model in list_effect_models(sorted(candidate.names), scale, pool.library)]
        for effects in choices:
            if pool.budget_spent or pool.is_at_floor(pool.find_best()):
                return
            if not any(e.form.action in _CONTACT_ACTIONS for e in effects):
                pool.search(effects)


def _select_beam(pool: CandidatePool, size: int, sets: list[Candidate], parent: Candidate) -> list[Candidate]:
    """Return the sets of one size that are extended next, the best first; empty at the end of the search."""
    settings = pool.settings
    if not sets or size > len(settings.beam_widths) or not _is_worth_extending(pool, sets[0], parent):
        return []
    if pool.place_drive_steps(sets[0]):
        sets = [pool.candidates[c.names] for c in sets]
    pool.noise_model.update(sets[0], pool.problems.full, pool.evaluation)
    limit = settings.beam_ratio * max(pool.compute_excess(sets[0]), settings.negligible_excess)
    return [c for c in sets if pool.compute_excess(c) < limit][: settings.beam_widths[size - 1]]


def _is_noise(pool: CandidatePool, baseline: Candidate) -> bool:
    """Return True if the baseline is so close to the noise floor that no effect is searched for.

    Where what does not repeat with the cycles is not noise, the floor becomes that of high frequencies.
    """
    noise_model = pool.noise_model
    if not (pool.is_at_floor(baseline) or _is_gap_negligible(pool, baseline)):
        return False
    if not discard_unsteady_cycles(
        noise_model, baseline, pool.evaluation, pool.propagate_input_noise, pool.problems.block_length
    ):
        return True
    pool.notes.append(f"the noise floor is that at {noise_model.estimate.basis}")
    noise_model.update(baseline, pool.problems.full, pool.evaluation)
    return pool.is_at_floor(baseline)


def _is_explained(pool: CandidatePool, best: Candidate) -> bool:
    """Return True if the forward search ends because a set is at the noise floor.

    What such a set leaves of a large gap may still contain an effect that a linear step finds. It is fitted before
    the floor can be taken from the residual without it.
    """
    if not pool.is_at_floor(best) or _discard_disproved_floor(pool, best):
        return False
    for gain in pool.screen(best, best.names)[:1] if is_extension_promising(pool, best.names) else ():
        if is_dominant(pool, gain):
            fit_extension(pool, best, gain)
    return True


def _discard_disproved_floor(pool: CandidatePool, best: Candidate) -> bool:
    """Discard the noise floor of repeated cycles if a set leaves significantly less; return True if so.

    Cycles count all that does not repeat with them as noise, so a missing effect may be a part of their floor.
    """
    if not pool.noise_model.is_disproved_by(best):
        return False
    pool.noise_model.discard_cycles(best)
    pool.notes.append(f"the noise floor is that at {pool.noise_model.estimate.basis}")
    return not pool.is_at_floor(best)


def _fit_certain_effects(pool: CandidatePool) -> bool:
    """Fit the effects that noise cannot imitate, with the law inside a wide interval of the floor; True if any.

    The evidence in noise of the residual's spectrum then counts for them: excesses cannot tell them from none.
    """
    if not pool.has_uncertain_floor:
        return False
    law = frozenset[str]()
    for gain in select_best_forms(pool.screen(pool.baseline, law))[: pool.settings.shortlist_sizes[0]]:
        candidate = fit_extension(pool, pool.baseline, gain)
        if not pool.comparison.exceeds_noise(pool.baseline, candidate):
            continue
        _fit_law_from(pool, candidate)
        pool.fit_fully(law)
        pool.fit_fully(candidate.names)
        known, found = pool.baseline, pool.candidates[candidate.names]
        if pool.comparison.exceeds_noise(known, found):
            evidence = pool.comparison.compute_noise_evidence(known, found)
            pool.block_evidence[candidate.names] = BlockEvidence(law, evidence)
    if not pool.block_evidence:
        # Sets that noise can imitate are not alternatives to the law.
        pool.candidates = {law: pool.baseline}
    return bool(pool.block_evidence)


def _is_gap_negligible(pool: CandidatePool, baseline: Candidate) -> bool:
    """Return True if the error of the baseline is within the limits of the verdict ``no_gap``."""
    fitted, held_out = pool.no_gap_limits
    return baseline.train_rmse < fitted and baseline.held_out_rmse < held_out


def _is_explained_by_clocks(pool: CandidatePool) -> bool:
    """Return True if no gap remains once the delay may drift as far as the clocks in the log allow."""
    if not pool.clock_deviation:
        return False
    corrected, drift = subtract_clock_drift(
        pool.baseline, pool.problems.full, pool.evaluation, pool.clock_deviation
    )
    if not _is_gap_negligible(pool, corrected):
        return False
    pool.candidates[corrected.names] = corrected
    pool.full_fits.add(corrected.names)
    pool.notes.append(describe_drift_explanation(drift))
    return True


def _is_worth_extending(pool: CandidatePool, best: Candidate, parent: Candidate) -> bool:
    """Return True if a set closes enough of its parent's excess; with a large gap, one effect may close little."""
    return _closes_enough(pool, best, parent) or (
        not parent.names and pool.compute_excess(best) > pool.settings.large_excess
    )


def _closes_enough(pool: CandidatePool, best: Candidate, parent: Candidate) -> bool:
    """Return True if a set closes enough of its parent's excess to grow from there."""
    return pool.compute_excess(best) < pool.settings.extension_share * pool.compute_excess(parent)


def _fit_other_effects(pool: CandidatePool) -> None:
    """Fit every effect alone that was not on the shortlist, each in its best form.

    A certain error of the law has a cause, even where no linear step finds it. The law may have taken over what
    the effect does, or the effect has no zero size. An effect whose starts all diverge is left out.
    """
    for gain in select_best_forms(pool.screen(pool.baseline, frozenset())):
        if pool.budget_spent or compute_expected_gain(gain) == -np.inf:
            return
        if frozenset({gain.effect_model.name}) not in pool.candidates:
            fit_extension(pool, pool.baseline, gain)


def _fit_extensions(pool: CandidatePool, parent: Candidate, count: int) -> None:
    """Fit a set with each further effect of the shortlist, and with each mounting effect."""
    settings, excess = pool.settings, pool.compute_excess(parent)
    gains = pool.screen(parent, parent.names)
    if not parent.names and excess > settings.large_excess:
        count = settings.large_shortlist
    if excess < settings.small_excess and compute_expected_gain(gains[0]) < settings.small_excess_gain:
        return
    for gain in select_shortlist(gains, count):
        if pool.budget_spent:
            return
        fit_extension(pool, parent, gain)
    for name in MOUNTING_EFFECTS:
        if not pool.budget_spent and is_mounting_promising(pool, parent, name):
            fit_mounting(pool, parent, gains, name)


def compute_final_posterior(pool: CandidatePool) -> Posterior:
    """Fit the most probable sets on all samples, extend the first, and compute the posterior of all sets."""
    _fit_probable_sets(pool)
    most_probable = pool.fit_most_probable_set(CandidatePool.compute_posterior)
    for _ in range(pool.settings.max_extensions):
        if not try_extension(pool, most_probable):
            break
        most_probable = pool.compute_posterior().most_probable_set
        pool.fit_fully(most_probable)
    exchange_mounting(pool, most_probable)
    check_effects(pool)
    return pool.compute_posterior()


def _fit_probable_sets(pool: CandidatePool) -> None:
    """Fit on all samples: the baseline, the most probable sets, and the subsets of the first."""
    posterior = pool.compute_posterior()
    likely = [names for names, p in posterior.rank_sets()[:MAX_TIED_SETS] if p > MIN_TIED_PROBABILITY]
    if posterior.unknown > UNKNOWN_THRESHOLD:
        likely.append(pool.find_best().names)
    subsets = [names - {name} for names in likely[:1] if len(names) > 1 for name in sorted(names)]
    for names in dict.fromkeys([frozenset[str](), *likely, *(s for s in subsets if s in pool.candidates)]):
        pool.fit_fully(names)
