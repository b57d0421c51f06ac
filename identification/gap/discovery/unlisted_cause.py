"""Curves as evidence against named effects with a larger excess.

Effects of the library can together resemble a cause that none of them is. A curve at the place of that cause, over
its variable, then has a smaller excess than they have. Curves where the library has an effect are fitted as well.
Where one of them has the smallest excess, the cause may be that effect in another form.
"""

from collections.abc import Mapping

import numpy as np

from identification.damper.definitions import STAGE_OF
from identification.damper.effects import STAGES, Action, Effect, Place, Stage, Variable
from identification.gap.data import compute_residual_correlation_length
from identification.gap.discovery.curve_effects import CurvePlace
from identification.gap.discovery.curve_fit import FittedCurve, fit_best_curves, screen_curves
from identification.gap.fits import EXPLAINED_RATIO, Candidate
from identification.gap.selection import (
    BlockEvidence,
    CandidatePool,
    CurveAlternative,
    Posterior,
    normalise_scores,
)
from identification.threads import use_one_thread

_STATIC_ACTIONS: frozenset[Action] = frozenset(
    {
        "field",
        "field_memory",
        "scaling",
        "softening",
        "parallel_force",
        "hysteretic_force",
        "inertia",
        "additive_force",
        "displacement_map",
        "displacement_shift",
        "drive_function",
        "field_function",
        "gain_function",
        "force_function",
        "elongation_function",
        "mount_function",
        "channel_function",
        "displacement_function",
    }
)
"""Actions that a curve over one variable can represent."""


_RESPONSE_ACTIONS: frozenset[Action] = frozenset(
    {"drive_delay", "drive_response", "time_shift", "force_lag", "channel_response"}
)
"""Actions that a step response can represent."""
_Cause = tuple[Place, Variable, bool]
"""Place and variable of a curve, and whether it is a step response."""


def is_unlisted(at: CurvePlace, library: Mapping[str, Effect]) -> bool:
    """Return True if no effect of a library acts at the place of a curve over its variable."""
    return _get_cause(at) not in list_causes(library)


def _get_cause(at: CurvePlace) -> _Cause:
    return at.place, at.variables[0], at.is_response


def list_causes(library: Mapping[str, Effect]) -> set[_Cause]:
    """Return the places of a library's effects with the variable over which each is a curve, and its kind."""
    causes: set[_Cause] = set()
    for effect in library.values():
        for form in effect.forms:
            if form.action in _STATIC_ACTIONS:
                causes.add((form.place, effect.variable, False))
            if form.action in _RESPONSE_ACTIONS:
                causes.add((form.place, effect.variable, True))
            if form.action == "connection":
                causes.add((form.place, "force", False))
            if form.action == "hysteretic_force":
                causes.add((form.place, "travel_since_reversal", False))
    return causes


def compare_with_curves(pool: CandidatePool, posterior: Posterior) -> Posterior:
    """Return the posterior with the best curve as one of the alternatives.

    Curves are only fitted where the most probable set leaves more than the noise floor, or reaches it by chance
    or within a wide interval alone; else nothing changes. A curve outside the library stands for an unknown
    cause. One at the place of an effect stands for that effect in another form, if it alone reaches the floor:
    several effects that leave more only repair the form of that one. Block evidence can raise the odds of a set
    far above those that its excess gives, so the curve has it too.
    """
    names = posterior.most_probable_set
    named = pool.candidates[names]
    is_low = max(named.train_rmse, named.held_out_rmse) < EXPLAINED_RATIO * pool.floor
    if not names or (is_low and not pool.has_uncertain_floor):
        return posterior
    best = find_best_curve(pool)
    cause = _name_cause(pool, best) if best else None
    if best is None or cause is None:
        return posterior
    compare = _compare_in_noise if pool.reaches_floor(named) else _compare_on_held_out_samples
    evidence = compare(pool, named, best)
    if evidence is None:
        return posterior
    pool.curve = CurveAlternative(cause, best.candidate, BlockEvidence(names, evidence))
    pool.fit_most_probable_set(CandidatePool.compute_posterior)
    return pool.compute_posterior()


def _compare_on_held_out_samples(pool: CandidatePool, named: Candidate, best: FittedCurve) -> float | None:
    """Return the block evidence on held-out samples for a curve over a set of effects."""
    return pool.comparison.compute_held_out_evidence(named, best.candidate)


def _compare_in_noise(pool: CandidatePool, named: Candidate, best: FittedCurve) -> float | None:
    """Return the evidence for a curve outside the library over effects that may reach the floor; None if small.

    Each coefficient of the curve also fits noise, so it has to bring one to the log likelihood (Akaike 1974).
    """
    freedom = len(best.curve.model.quantities)
    is_listed = not is_unlisted(best.curve.at, pool.library)
    if is_listed or not pool.comparison.exceeds_noise(named, best.candidate, freedom):
        return None
    return pool.comparison.compute_noise_evidence(named, best.candidate) - freedom


def find_best_curve(pool: CandidatePool) -> FittedCurve | None:
    """Return the best curve with the law; None if the recording can show none."""
    curves = fit_best_curves(pool, pool.baseline, screen_curves(pool, pool.baseline))
    return curves[0] if curves else None


def _name_cause(pool: CandidatePool, best: FittedCurve) -> frozenset[str] | None:
    """Return the name of the cause that a curve stands for; None if it is no alternative to the sets."""
    if is_unlisted(best.curve.at, pool.library):
        return best.candidate.names
    if not pool.reaches_floor(best.candidate):
        return None
    cause = _get_cause(best.curve.at)
    single = [names for names in pool.candidates if len(names) == 1]
    alike = [names for names in single if cause in list_causes({name: pool.library[name] for name in names})]
    return min(alike, key=lambda names: pool.compute_excess(pool.candidates[names]), default=None)


def locate_unlisted_cause(pool: CandidatePool, parent: Candidate) -> dict[Stage, float]:
    """Return the probability of each stage for a cause outside the library, in addition to a set of effects.

    The evidence of the best curve or fitted set at each stage decides. It is divided by the correlation length of
    the residual, because the errors of neighbouring samples are alike. It counts as far as the best one closes the
    gap. A cause that nothing resembles is equally probable at all stages.
    """
    problem = pool.problems.screening.replace_effects(parent.fit.effects)
    with use_one_thread():
        screened = screen_curves(pool, parent)
        unknowns = parent.fit.minimum.unknowns
        errors = [problem.compute_residuals(unknowns, i)[0] for i in range(len(problem.pieces))]
    odds = dict.fromkeys(STAGES, 0.0) | _compare_sets(pool, parent, problem.samples)
    for curve, evidence in screened:
        stage = STAGE_OF[curve.at.place]
        odds[stage] = max(odds[stage], evidence.log_odds)
    scores = np.array([odds[stage] for stage in STAGES]) / compute_residual_correlation_length(errors)
    cost = float(sum(r @ r for r in errors))
    excess = max(cost - problem.samples, 1.0)
    closed = min(2.0 * max(odds.values()) * cost / problem.samples / excess, 1.0)
    shares = closed * normalise_scores(scores) + (1.0 - closed) / len(STAGES)
    return dict(zip(STAGES, map(float, shares), strict=True))


def _compare_sets(pool: CandidatePool, parent: Candidate, samples: int) -> dict[Stage, float]:
    """Return the log odds of the best fitted extension of a set at each stage at which there is one.

    Backlash is no curve of one variable, so only the effects of the library stand for it.
    """
    odds: dict[Stage, float] = {}
    before = pool.compute_excess(parent)
    for names, candidate in pool.candidates.items():
        stages = {pool.library[name].stage for name in names - parent.names}
        if names > parent.names and len(stages) == 1:
            stage, after = stages.pop(), max(pool.compute_excess(candidate), 0.0)
            odds[stage] = max(odds.get(stage, 0.0), 0.5 * samples * (before - after) / (1.0 + after))
    return odds
