"""Verdict, named set and its effects, from the candidates and their posterior."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from identification.documents import EffectSet, EffectValue, NamedEffect, Verdict
from identification.fitting import EffectModel
from identification.gap.data import EvaluationData, Shrinkage
from identification.gap.fits import Candidate
from identification.gap.outcome.interval import compute_interval
from identification.gap.selection import UNKNOWN_THRESHOLD, CandidatePool, Posterior

_MIN_NAMED_SHARE = 0.2
"""Smallest part of the gap that a named set closes."""
_EXPLAINED_SHARE = 0.95
"""Part of the gap above which it counts as explained, unless an unknown cause is more probable than the set."""
_FLOOR_RATIO = 1.03
"""Threshold on the RMSE of the law relative to the noise floor: below it, nothing is left to explain."""
_MIN_CHANCE = 0.05
"""Probability that nothing is missing, above which a law inside the floor's interval is taken for complete."""
_AMBIGUOUS_RATIO = 0.5
"""Threshold on the probability of an alternative over that of the named set: above it, the answer is ambiguous."""
_MAX_ALTERNATIVES = 3
"""Largest number of alternatives."""
_MIN_PROBABILITY = 0.01
"""Smallest probability of an alternative."""

Share = tuple[float, tuple[float, float]]
"""Part of the gap's variance that returns without an effect [1], with its 95 % interval."""


class NamedSet(NamedTuple):
    """Set of effects that is named, with its verdict."""

    verdict: Verdict
    candidate: Candidate
    """The named set; the law alone if none is named."""
    shrinkage: Shrinkage
    posterior: Posterior
    """Probabilities from which it was chosen."""


def choose_named_set(
    pool: CandidatePool, evaluation: EvaluationData, posterior: Posterior, partial: Posterior | None
) -> NamedSet:
    """Return the named set with its verdict; the law alone if none is named.

    Where no set explains the gap, one is named as a part of the cause: the most probable one that closes enough of
    the gap on unseen strokes.

    Args:
        pool: the fitted sets.
        evaluation: the recordings, cut into cycles.
        posterior: probabilities of the sets as the whole cause.
        partial: probabilities of the sets as a part of the cause; None where the library probably has the cause.
    """
    chosen = _decide_set(pool, evaluation, posterior, posterior.most_probable_set)
    if partial is not None and chosen.verdict in ("unexplained", "partly_explained"):
        parts = (_decide_set(pool, evaluation, partial, names) for names in list_likely_sets(partial))
        part = next((part for part in parts if part.candidate.names), None)
        if part is not None:
            return part._replace(verdict="partly_explained")
    return chosen


def _decide_set(
    pool: CandidatePool, evaluation: EvaluationData, posterior: Posterior, names: frozenset[str]
) -> NamedSet:
    """Return the verdict with one set of a posterior."""
    baseline, named = pool.baseline, pool.candidates[names]
    is_certain = _is_at_floor(baseline, pool.floor, pool.no_gap_limits) and _exceeds_noise(pool, posterior, named)
    is_unlisted = pool.curve is not None and pool.curve.names not in pool.candidates
    verdict = decide_verdict(
        baseline,
        named,
        pool.floor,
        pool.no_gap_limits,
        posterior,
        is_certain=is_certain,
        has_unlisted_curve=is_unlisted,
    )
    shrinkage = estimate_expected_shrinkage(pool, evaluation, named)
    benefit = shrinkage.expected_benefit
    if verdict == "partly_explained" and not closes_part(shrinkage):
        verdict = "unexplained"
    if verdict == "unexplained" and is_certain:
        # Nothing can be named, and the error of the law is inside the interval of the floor.
        verdict = "no_gap"
    if named.names and benefit is not None and benefit < 0.0:
        verdict = decide_unnamed_verdict(baseline, pool.floor, pool.no_gap_limits)
    if named.names and verdict in ("no_gap", "unexplained"):
        return NamedSet(verdict, baseline, estimate_expected_shrinkage(pool, evaluation, baseline), posterior)
    return NamedSet(verdict, named, shrinkage, posterior)


def _exceeds_noise(pool: CandidatePool, posterior: Posterior, named: Candidate) -> bool:
    """Return True if effects are certain although the error of the law is inside the interval of the floor."""
    if not named.names or posterior.sets.get(frozenset(), 0.0) > _MIN_CHANCE:
        return False
    return pool.comparison.exceeds_noise(pool.baseline, named)


def estimate_expected_shrinkage(
    pool: CandidatePool, evaluation: EvaluationData, candidate: Candidate
) -> Shrinkage:
    """Estimate how far the gap shrinks with a set of effects on another run of the damper."""
    noise = pool.noise_model.estimate_noise(candidate)
    input_noise = np.zeros((1, len(evaluation.force)))
    if candidate.names:
        input_noise = pool.noise_model.sample_other_runs(candidate, pool.problems.full)
    chance = candidate.chance_excess * pool.floor**2
    return evaluation.estimate_shrinkage(pool.baseline.residual, candidate.residual, noise, input_noise, chance)


def decide_verdict(
    baseline: Candidate,
    named: Candidate,
    floor: float,
    no_gap_limits: tuple[float, float],
    posterior: Posterior,
    *,
    is_certain: bool = False,
    has_unlisted_curve: bool = False,
) -> Verdict:
    """Decide the verdict; the worse of fitted and held-out samples counts, and the held-out ones for a part.

    Effects that close a part of the gap are named even where an unknown cause is more probable. They reduce the
    error on strokes that no fit used. Their probabilities then state that the cause may be another one.

    Args:
        baseline: the law without effects.
        named: the most probable set.
        floor: noise floor [N].
        no_gap_limits: RMSE of the baseline on fitted and on held-out samples [N] up to which the verdict is
            ``no_gap``.
        posterior: probabilities of the sets.
        is_certain: whether noise of the residual's spectrum cannot be what the set explains.
        has_unlisted_curve: whether a curve outside the library is an alternative to the set.
    """
    at_floor = _is_at_floor(baseline, floor, no_gap_limits) and not is_certain
    if at_floor or (not named.names and posterior.unknown < UNKNOWN_THRESHOLD):
        return "no_gap"
    baseline_excess = max(baseline.compute_excess(floor), 1e-12)
    closed = 1.0 - named.compute_relative_excess(baseline, floor) / baseline_excess
    unknown = posterior.unknown > posterior.sets[named.names]
    unseen = _compute_closed_part(baseline, named, floor)
    if not named.names or max(closed, unseen) < _MIN_NAMED_SHARE:
        return "unexplained"
    reaches_floor = named.reaches_floor(floor) and not (has_unlisted_curve and unknown)
    if reaches_floor or (closed > _EXPLAINED_SHARE and not unknown):
        return "explained"
    return "partly_explained"


def _is_at_floor(baseline: Candidate, floor: float, no_gap_limits: tuple[float, float]) -> bool:
    """Return True if the error of the law is inside the interval of the noise floor."""
    fitted_limit, held_out_limit = no_gap_limits
    return baseline.held_out_rmse < held_out_limit and baseline.train_rmse < max(
        _FLOOR_RATIO * floor, fitted_limit
    )


def _compute_closed_part(baseline: Candidate, named: Candidate, floor: float) -> float:
    """Compute the part of the gap that a set closes on held-out samples [1]; zero if it harms the fitted ones."""
    gap = baseline.held_out_rmse**2 - floor**2
    if gap <= 0.0 or named.train_rmse > baseline.train_rmse:
        return 0.0
    return 1.0 - (named.held_out_rmse**2 - floor**2) / gap


def closes_part(shrinkage: Shrinkage) -> bool:
    """Return True if effects close a fifth of the gap on another run, and the interval is above zero."""
    value, interval = shrinkage.value, shrinkage.ci95
    return value is not None and interval is not None and value >= _MIN_NAMED_SHARE and interval[0] > 0.0


def decide_unnamed_verdict(baseline: Candidate, floor: float, no_gap_limits: tuple[float, float]) -> Verdict:
    """Decide the verdict where the most probable set is not named because it is expected to harm another run."""
    fitted, held_out = (max(_FLOOR_RATIO * floor, limit) for limit in no_gap_limits)
    at_floor = baseline.train_rmse < fitted and baseline.held_out_rmse < held_out
    return "no_gap" if at_floor else "unexplained"


def build_named_effects(
    candidate: Candidate, posterior: Posterior, shares: Mapping[str, Share], drive_unit: str
) -> list[NamedEffect]:
    """Return the effects of a set with their parameters and intervals, the largest share first."""
    fit = candidate.fit
    named = [
        NamedEffect(
            name=model.name,
            stage=model.effect.stage,
            place=model.form.place,
            variable=model.effect.variable,
            form=model.form_name,
            parameters=_build_values(model, active.values, fit.deviations[model.name], drive_unit),
            share=shares[model.name][0],
            share_ci95=shares[model.name][1],
            probability=min(posterior.compute_effect_probability(model.name), 1.0),
            note=_describe_sense(model.form_name),
        )
        for model, active in zip(fit.effects, fit.active_effects, strict=True)
    ]
    return sorted(named, key=lambda e: -e.share)


def _build_values(
    model: EffectModel, values: Sequence[float], deviations: Mapping[str, float], drive_unit: str
) -> dict[str, EffectValue]:
    """Return the parameters of an effect with their units and intervals, by name."""
    return {
        q.symbol: EffectValue(
            value=value,
            unit=q.format_unit(drive_unit),
            ci95=compute_interval(value, deviations[q.symbol], q.low, q.high),
        )
        for q, value in zip(model.quantities, values, strict=True)
    }


def _describe_sense(form: str) -> str:
    """Return the note on the sense of a reversed form; empty for others."""
    if form.endswith("_reversed"):
        return "stiffer at positive displacement: compression counts as positive in this recording"
    return ""


def list_alternatives(posterior: Posterior, named: frozenset[str]) -> list[EffectSet]:
    """Return at most three other sets, the most probable first."""
    others = [(names, p) for names, p in posterior.rank_sets() if names != named and p > _MIN_PROBABILITY]
    return [EffectSet(effects=sorted(names), probability=p) for names, p in others[:_MAX_ALTERNATIVES]]


def list_likely_sets(posterior: Posterior) -> list[frozenset[str]]:
    """Return the most probable set and those that the data hardly distinguish from it, most probable first."""
    ranked = posterior.rank_sets()
    return [names for names, p in ranked if p >= _AMBIGUOUS_RATIO * ranked[0][1]]


def is_ambiguous(alternatives: Sequence[EffectSet], probability: float) -> bool:
    """Return True if an alternative is nearly as probable as the named set of a probability [1]."""
    return any(a.probability > _AMBIGUOUS_RATIO * probability for a in alternatives)
