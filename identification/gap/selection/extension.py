"""Extension of the most probable set by one effect, after its full fit (decision 0016).

The forward search uses decimated data. It ends where the form error of a set could mask a further effect. Here the
set is fitted on all samples, and the further effects with the largest expected gains are compared by block
evidence. A confusable effect acts on the same variable as one in the set, and can absorb its form error. Block
evidence cannot separate the two. A confusable effect therefore pays an additional penalty. It is only considered
if a linear step expects it to close as much as a missing effect does, if it is fitted from its own side, or if the
search has fitted it (decision 0061). At the end, each effect of the set is compared with the set without it.
"""

from collections.abc import Collection

from identification.gap.fits import Candidate
from identification.gap.noise import ResidualRegression, take_floor_from_residual
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.mounting import closes_part
from identification.gap.selection.neighbours import find_subset, fit_extension
from identification.gap.selection.posterior import BlockEvidence, compute_complexity_penalty, compute_log_prior
from identification.gap.selection.screening import ScreeningResult, compute_expected_gain, select_shortlist

_CONFUSABLE_EFFECTS = (
    {"clevis_backlash", "fixture_compliance", "end_stop", "side_load_friction"},
    {"gas_spring", "end_stop", "side_load_friction", "displacement_nonlinearity"},
    {"seal_friction", "orifice_turbulence", "shear_thinning", "direction_asymmetry"},
    {"field_saturation", "magnetic_remanence", "coil_crosstalk"},
    {"moving_mass", "force_delay", "force_filter", "displacement_delay"},
    {"viscous_heating", "force_drift"},
)
"""Effects that act at stroke reversals, or on displacement, velocity, field, acceleration or time."""


def try_extension(pool: CandidatePool, names: frozenset[str]) -> bool:
    """Fit a set with one more effect; return True if any is accepted.

    Its block evidence has to exceed the complexity penalty, and it has to close enough of what the set leaves.
    """
    if not is_extension_promising(pool, names):
        return False
    confusable = set[str]().union(*(group for group in _CONFUSABLE_EFFECTS if names & group))
    penalty = compute_complexity_penalty(names)
    _fit_confusable_pairs(pool, names, confusable - names)
    extended = _fit_extensions(pool, names, confusable)
    for larger in extended:
        pool.fit_fully(larger)
    # A larger set can be the first whose residual is noise. Over a lower floor, noise would count as error.
    if settle_floor(pool, pool.candidates.values()):
        pool.update_residuals()
    for larger in extended:
        known, found = pool.candidates[names], pool.candidates[larger]
        if pool.comparison.compute_closed_share(known, found) < pool.settings.min_closed_share:
            continue
        confusion = pool.settings.confusion_penalty if larger & confusable - names else 0.0
        evidence = pool.comparison.compute_evidence(known, found) - confusion
        pool.block_evidence[larger] = BlockEvidence(names, evidence)
    accepted = [n for n in extended if n in pool.block_evidence and pool.block_evidence[n].log_odds > penalty]
    for larger in accepted:
        for model in pool.candidates[larger].fit.effects:
            find_subset(pool, pool.candidates[larger], model)
    return bool(accepted)


def _fit_confusable_pairs(pool: CandidatePool, names: frozenset[str], partners: set[str]) -> None:
    """Fit a single effect together with each confusable one, from the fit of the other one.

    The form of the single effect may have taken over what the other does, so nothing is predicted from its side.
    """
    if len(names) > 1:
        return
    (model,) = pool.candidates[names].fit.effects
    values = pool.candidates[names].fit.active_effects[0].values
    for other in (pool.candidates.get(frozenset({partner})) for partner in sorted(partners)):
        if other is None or not closes_part(pool, other) or names | other.names in pool.full_fits:
            continue
        forms = [g for g in pool.screen(other, other.names) if g.effect_model.name == model.name]
        for gain in forms:
            if gain is forms[0]:
                fit_extension(pool, other, gain)
            elif gain.effect_model == model:
                fit_extension(pool, other, gain, [values])


def is_dominant(pool: CandidatePool, gain: ScreeningResult) -> bool:
    """Return True if an effect is expected to close as much of what a set leaves as a missing effect does."""
    return compute_expected_gain(gain) > pool.settings.min_closed_share


def settle_floor(pool: CandidatePool, candidates: Collection[Candidate]) -> bool:
    """Take the noise floor from candidates whose residual is noise; return False if the floor stays."""
    return take_floor_from_residual(
        pool.noise_model,
        candidates,
        ResidualRegression(pool.evaluation, pool.floor),
        pool.problems.block_length,
        pool.evaluate,
        pool.refit_usable_samples,
        pool.propagate_input_noise,
    )


def _fit_extensions(pool: CandidatePool, names: frozenset[str], confusable: set[str]) -> list[frozenset[str]]:
    """Return the sets with a further effect of the shortlist, and the best extension that is already known.

    A confusable effect is on the list if it is expected to close as much as a missing effect does.
    """
    known, sets = pool.candidates[names], []
    gains = [
        gain
        for gain in pool.screen(known, names)
        if gain.effect_model.name not in confusable or is_dominant(pool, gain)
    ]
    for gain in select_shortlist(gains, pool.settings.extension_effects):
        sets.append(names | {gain.effect_model.name})
        if sets[-1] not in pool.full_fits:
            fit_extension(pool, known, gain)
    extensions = [n for n in pool.candidates if len(n) == len(names) + 1 and names < n]
    best = sorted(extensions, key=lambda n: pool.compute_excess(pool.candidates[n]))[:1]
    return list(dict.fromkeys([*sets, *best]))


def is_extension_promising(pool: CandidatePool, names: frozenset[str]) -> bool:
    """Return True if the set closes most of the gap and one more effect could pay the complexity penalty."""
    if not 0 < len(names) < pool.settings.max_effects:
        return False
    known = pool.candidates[names]
    explains = pool.compute_excess(known) < pool.settings.max_remaining_share * pool.baseline_excess
    return explains and pool.comparison.bound_evidence(known) > compute_complexity_penalty(names)


def check_effects(pool: CandidatePool) -> None:
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
        pool.held_out_evidence[names] = tuple(compare_with_subset(pool, subset, candidate) for subset in subsets)


def compare_with_subset(pool: CandidatePool, subset: Candidate, candidate: Candidate) -> BlockEvidence:
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
