"""Extension of the most probable set by one effect, after its full fit (decision 0016).

The forward search uses decimated data. It ends where the form error of a set could mask a further effect. Here the
set is fitted on all samples, and the further effects with the largest expected gains are compared by block
evidence. A confusable effect acts on the same variable as one in the set, and can absorb its form error. Block
evidence cannot separate the two. A confusable effect therefore pays an additional penalty, and only sets that the
search has already fitted are considered.
"""

from collections.abc import Collection

from identification.gap.fits import Candidate
from identification.gap.noise import ResidualRegression, take_floor_from_residual
from identification.gap.selection.candidate_pool import CandidatePool
from identification.gap.selection.neighbours import find_subset, fit_extension
from identification.gap.selection.posterior import BlockEvidence, compute_complexity_penalty
from identification.gap.selection.screening import select_shortlist

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
    if not _is_extension_promising(pool, names):
        return False
    confusable = set[str]().union(*(group for group in _CONFUSABLE_EFFECTS if names & group))
    penalty = compute_complexity_penalty(names)
    extended = _fit_extensions(pool, names, names | confusable)
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


def _fit_extensions(pool: CandidatePool, names: frozenset[str], without: frozenset[str]) -> list[frozenset[str]]:
    """Return the sets with a further effect of the shortlist, and the best extension that is already known."""
    known, sets = pool.candidates[names], []
    for gain in select_shortlist(pool.screen(known, without), pool.settings.extension_effects):
        sets.append(names | {gain.effect_model.name})
        if sets[-1] not in pool.full_fits:
            fit_extension(pool, known, gain)
    extensions = [n for n in pool.candidates if len(n) == len(names) + 1 and names < n]
    best = sorted(extensions, key=lambda n: pool.compute_excess(pool.candidates[n]))[:1]
    return list(dict.fromkeys([*sets, *best]))


def _is_extension_promising(pool: CandidatePool, names: frozenset[str]) -> bool:
    """Return True if the set closes most of the gap and one more effect could pay the complexity penalty."""
    if not 0 < len(names) < pool.settings.max_effects:
        return False
    known = pool.candidates[names]
    explains = pool.compute_excess(known) < pool.settings.max_remaining_share * pool.baseline_excess
    return explains and pool.comparison.bound_evidence(known) > compute_complexity_penalty(names)
