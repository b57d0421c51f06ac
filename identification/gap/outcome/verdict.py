"""Verdict and named effects, from the candidates and their posterior."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.documents import EffectSet, EffectValue, NamedEffect, Verdict
from identification.gap.fits import Candidate
from identification.gap.outcome.interval import compute_interval
from identification.gap.selection import UNKNOWN_THRESHOLD, Posterior

_MIN_NAMED_SHARE = 0.3
"""Smallest part of the gap that a named set closes."""
_EXPLAINED_SHARE = 0.9
"""Part of the gap above which it counts as explained, unless an unknown cause is more probable than the set."""
_FLOOR_RATIO = 1.03
"""Threshold on the RMSE relative to the noise floor: below it, nothing is left to explain."""
_MAX_ALTERNATIVES = 3
"""Largest number of alternatives."""
_MIN_PROBABILITY = 0.01
"""Smallest probability of an alternative."""


def decide_verdict(
    baseline: Candidate, named: Candidate, floor: float, no_gap_limit: float, posterior: Posterior
) -> Verdict:
    """Decide the verdict; the worse of fitted and held-out samples counts.

    A set that leaves a gap is not named where an unknown cause is more probable.

    Args:
        baseline: the law without effects.
        named: the most probable set.
        floor: noise floor [N].
        no_gap_limit: RMSE of the baseline [N] up to which the verdict is ``no_gap``.
        posterior: probabilities of the sets.
    """
    at_floor = baseline.held_out_rmse < no_gap_limit and baseline.train_rmse < max(
        _FLOOR_RATIO * floor, no_gap_limit
    )
    if at_floor or (not named.names and posterior.unknown < UNKNOWN_THRESHOLD):
        return "no_gap"
    baseline_excess = max(baseline.compute_excess(floor), 1e-12)
    closed = 1.0 - named.compute_relative_excess(baseline, floor) / baseline_excess
    unknown = posterior.unknown > posterior.sets[named.names]
    if not named.names or closed < _MIN_NAMED_SHARE or (unknown and closed < _EXPLAINED_SHARE):
        return "unexplained"
    reaches_floor = max(named.train_rmse, named.held_out_rmse) < _FLOOR_RATIO * floor
    if reaches_floor or (closed > _EXPLAINED_SHARE and not unknown):
        return "explained"
    return "partly_explained"


def decide_unnamed_verdict(baseline: Candidate, floor: float, no_gap_limit: float) -> Verdict:
    """Decide the verdict where the most probable set is not named because it is expected to harm another run."""
    limit = max(_FLOOR_RATIO * floor, no_gap_limit)
    return "no_gap" if max(baseline.train_rmse, baseline.held_out_rmse) < limit else "unexplained"


def build_named_effects(
    candidate: Candidate, posterior: Posterior, shares: Mapping[str, float], drive_unit: str
) -> list[NamedEffect]:
    """Return the effects of a set with their parameters and intervals, the largest share first."""
    fit = candidate.fit
    named = []
    for model, active in zip(fit.effects, fit.active_effects, strict=True):
        deviations = fit.deviations[model.name]
        parameters = {
            q.symbol: EffectValue(
                value=value,
                unit=q.format_unit(drive_unit),
                ci95=compute_interval(value, deviations[q.symbol], q.low, q.high),
            )
            for q, value in zip(model.quantities, active.values, strict=True)
        }
        named.append(
            NamedEffect(
                name=model.name,
                stage=model.effect.stage,
                form=model.form_name,
                parameters=parameters,
                share=shares[model.name],
                probability=min(posterior.compute_effect_probability(model.name), 1.0),
                note=_describe_sense(model.form_name),
            )
        )
    return sorted(named, key=lambda e: -e.share)


def _describe_sense(form: str) -> str:
    """Return the note on the sense of a reversed form; empty for others."""
    if form.endswith("_reversed"):
        return "stiffer at positive displacement: compression counts as positive in this recording"
    return ""


def list_alternatives(posterior: Posterior, named: frozenset[str]) -> list[EffectSet]:
    """Return at most three other sets, the most probable first."""
    others = [(names, p) for names, p in posterior.rank_sets() if names != named and p > _MIN_PROBABILITY]
    return [EffectSet(effects=sorted(names), probability=p) for names, p in others[:_MAX_ALTERNATIVES]]


def compute_shares(
    candidates: Mapping[frozenset[str], Candidate], named: frozenset[str], order: Sequence[str]
) -> dict[str, float]:
    """Return the part of the explained variance that is lost without each effect, by its name."""
    before, after = candidates[frozenset()].held_out_rmse ** 2, candidates[named].held_out_rmse ** 2
    explained = max(before - after, 1e-12)
    shares = {}
    for name in order:
        without = candidates.get(named - {name})
        lost = 1.0 if without is None else (without.held_out_rmse**2 - after) / explained
        shares[name] = float(np.clip(lost, 0.0, 1.0))
    return shares
