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
from identification.gap.selection.extension import try_extension
from identification.gap.selection.mounting import fit_mounting, is_mounting_promising
from identification.gap.selection.neighbours import find_subset, fit_extension
from identification.gap.selection.posterior import (
    MAX_TIED_SETS,
    MIN_TIED_PROBABILITY,
    UNKNOWN_THRESHOLD,
    BlockEvidence,
    Posterior,
    compute_complexity_penalty,
    compute_log_prior,
)
from identification.gap.selection.screening import (
    MOUNTING_EFFECTS,
    compute_expected_gain,
    list_effect_models,
    select_best_forms,
    select_shortlist,
    select_unpredicted,
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
        if pool.budget_spent or pool.is_at_floor(beam[0]):
            break
        for parent in beam:
            _fit_extensions(pool, parent, count)
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
    excess = pool.compute_excess(best)
    closes = excess < pool.settings.extension_share * pool.compute_excess(parent)
    return closes or (not parent.names and excess > pool.settings.large_excess)


def _fit_extensions(pool: CandidatePool, parent: Candidate, count: int) -> None:
    """Fit a set with each further effect of the shortlist, and with each mounting effect."""
    settings, excess = pool.settings, pool.compute_excess(parent)
    gains = pool.screen(parent, parent.names)
    if not parent.names and excess > settings.large_excess:
        count = settings.large_shortlist
    if excess < settings.small_excess and compute_expected_gain(gains[0]) < settings.small_excess_gain:
        return
    shortlist = select_shortlist(gains, count)
    if not shortlist and not parent.names:
        # A certain error of the law has a cause, even where no linear step finds it.
        shortlist = select_unpredicted(gains, count)
    for gain in shortlist:
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
    _check_effects(pool)
    return pool.compute_posterior()


def _check_effects(pool: CandidatePool) -> None:
    """Compute what each effect of the most probable set gains on held-out samples, until that set stays the same.

    An effect that only absorbs the form error of another gains on the fitted samples, and hardly on others, or it
    closes a small part of what the other leaves.
    """
    for _ in range(pool.settings.max_refits):
        names = pool.compute_posterior().most_probable_set
        if len(names) < 2 or names in pool.held_out_evidence:
            return
        pool.fit_fully(names)
        candidate = pool.candidates[names]
        subsets = [find_subset(pool, candidate, model) for model in candidate.fit.effects]
        pool.held_out_evidence[names] = tuple(_compare_with_subset(pool, subset, candidate) for subset in subsets)


def _compare_with_subset(pool: CandidatePool, subset: Candidate, candidate: Candidate) -> BlockEvidence:
    """Return the evidence on held-out samples for a set over one with an effect less.

    Where the effect hardly acts on them, they cannot judge it, and the evidence on all samples counts: transients
    after rare steps of the drive may all be fitted. An effect that closes too little of what the others leave only
    repairs their form. Its set is then less probable than the one without it, by the penalty for one more effect.
    The evidence is at most the likelihood ratio in noise of the residual's spectrum, less the prior odds.
    """
    comparison, penalty = pool.comparison, compute_complexity_penalty(subset.names)
    evidence = comparison.compute_held_out_evidence(subset, candidate)
    if comparison.expect_held_out_evidence(subset, candidate) < penalty:
        evidence = comparison.compute_evidence(subset, candidate)
    if comparison.compute_closed_share(subset, candidate) < pool.settings.min_closed_share:
        evidence = min(evidence, -penalty)
    required = compute_log_prior(subset.names) - compute_log_prior(candidate.names)
    evidence = min(evidence, comparison.compute_noise_evidence(subset, candidate) - required)
    return BlockEvidence(subset.names, evidence)


def _fit_probable_sets(pool: CandidatePool) -> None:
    """Fit on all samples: the baseline, the most probable sets, and the subsets of the first."""
    posterior = pool.compute_posterior()
    likely = [names for names, p in posterior.rank_sets()[:MAX_TIED_SETS] if p > MIN_TIED_PROBABILITY]
    if posterior.unknown > UNKNOWN_THRESHOLD:
        likely.append(pool.find_best().names)
    subsets = [names - {name} for names in likely[:1] if len(names) > 1 for name in sorted(names)]
    for names in dict.fromkeys([frozenset[str](), *likely, *(s for s in subsets if s in pool.candidates)]):
        pool.fit_fully(names)
