"""From the odds to an answer: which set is named, what its effects are worth, whether that explains the gap."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.gap.contender import Contender
from identification.gap.documents import EffectSet, EffectValue, NamedEffect, Verdict
from identification.gap.posterior import Odds

_NO_GAP = 1.008
"""[1] RMSE over the floor below which nothing is asked for, whatever fits a little better."""
_NOTHING_KNOWN = 0.3
"""[1] part of the gap that a set must take away to be named."""
_MOST = 0.9
"""[1] part of the gap beyond which it counts as explained, as far as nothing else is likely."""
_AT_FLOOR = 1.03
"""[1] RMSE over the floor at which nothing is left to explain."""
_UNLIKELY = 0.5
"""[1] probability of something unknown from which on a gap without a known cause is one."""
_ALTERNATIVES = 3
_POSSIBLE = 0.01
"""[1] probability below which a set is no alternative."""


def verdict_on(plain: Contender, named: Contender, floor: float, odds: Odds) -> Verdict:
    """The answer in a word; what counts is the worse of seen and unseen strokes.

    A set that leaves a gap is not named where something unknown is likelier than it.

    Args:
        plain: the law alone.
        named: the likeliest set.
        floor: what no effect explains [N].
        odds: of all sets.
    """
    nothing = plain.unseen < _NO_GAP * floor and plain.seen < _AT_FLOOR * floor
    if nothing or (not named.names and odds.unknown < _UNLIKELY):
        return "no_gap"
    taken = 1.0 - named.share_of(plain, floor) / max(plain.excess(floor), 1e-12)
    unknown = odds.unknown > odds.sets[named.names]
    if not named.names or taken < _NOTHING_KNOWN or (unknown and taken < _MOST):
        return "unexplained"
    if max(named.seen, named.unseen) < _AT_FLOOR * floor or (taken > _MOST and not unknown):
        return "explained"
    return "partly_explained"


def without_promise(plain: Contender, floor: float) -> Verdict:
    """The answer where the likeliest set is expected to make another run worse: it is not named."""
    return "no_gap" if max(plain.seen, plain.unseen) < _AT_FLOOR * floor else "unexplained"


def named_effects(
    contender: Contender, odds: Odds, shares: Mapping[str, float], drive_unit: str
) -> list[NamedEffect]:
    """The effects of a set with their parameters and intervals, the largest share first."""
    fit = contender.fit
    named = []
    for choice, active in zip(fit.effects, fit.active, strict=True):
        deviations = fit.deviations[choice.name]
        parameters = {
            q.symbol: EffectValue(
                value=value,
                unit=q.unit_for(drive_unit),
                ci95=interval(value, deviations[q.symbol], q.low, q.high),
            )
            for q, value in zip(choice.quantities, active.values, strict=True)
        }
        named.append(
            NamedEffect(
                name=choice.name,
                stage=choice.effect.stage,
                form=choice.form_name,
                parameters=parameters,
                share=shares[choice.name],
                probability=min(odds.of_effect(choice.name), 1.0),
                note=_note(choice.form_name),
            )
        )
    return sorted(named, key=lambda e: -e.share)


def interval(value: float, deviation: float, low: float, high: float) -> tuple[float, float]:
    """95 % interval inside the bounds; on the logarithm where the value cannot be zero."""
    if not np.isfinite(deviation):
        return min(low, value), max(high, value)
    if low > 0:
        factor = float(np.exp(min(1.96 * deviation / value, 50.0)))
        interval = value / factor, value * factor
    else:
        interval = value - 1.96 * deviation, value + 1.96 * deviation
    return min(max(interval[0], low), value), max(min(interval[1], high), value)


def _note(form: str) -> str:
    """The sense of a form that has one."""
    if form.endswith("turned"):
        return "stiffens at positive displacement: in this recording compression counts as positive"
    return ""


def alternatives(odds: Odds, named: frozenset[str]) -> list[EffectSet]:
    """At most three other sets, the likeliest first."""
    others = [(names, p) for names, p in odds.ranked() if names != named and p > _POSSIBLE]
    return [EffectSet(effects=sorted(names), probability=p) for names, p in others[:_ALTERNATIVES]]


def shares(
    contenders: Mapping[frozenset[str], Contender], named: frozenset[str], order: Sequence[str]
) -> dict[str, float]:
    """Part of the explained variance that is lost when an effect alone is left out, by its name."""
    plain, whole = contenders[frozenset()].unseen ** 2, contenders[named].unseen ** 2
    explained = max(plain - whole, 1e-12)
    lost = {}
    for name in order:
        without = contenders.get(named - {name})
        lost[name] = 1.0 if without is None else (without.unseen**2 - whole) / explained
    return {name: float(np.clip(part, 0.0, 1.0)) for name, part in lost.items()}
