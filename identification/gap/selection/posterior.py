"""Posterior of the sets of effects, from the part of the gap that each leaves.

The likelihood of white noise would be far too certain. With a hundred thousand samples, one per cent of misfit
would decide everything, but the form error of every library is larger. The odds therefore follow the *ratio* of
the excesses of two sets, to a fixed power, down to a resolution. The resolution is the error of the floor, and the
form error that even the correct effect leaves. Smaller sets are more probable beforehand. An unknown cause is one
of the alternatives. Known effects are expected to leave a larger part of its gap than the correct effects would.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.effects import COMMON_EFFECTS, EFFECTS, Effect, Stage

_LIKELIHOOD_EXPONENT = 6.0
"""Exponent of the ratio of excesses in the odds. Origin: calibrated on recordings with a known effect."""
_EXCESS_RESOLUTION = 0.004
"""Smallest significant excess, from the input noise that a fit propagates [1]."""
_RESOLUTION_SAMPLES = 10.0
"""Further insignificant excess of a short recording: this over the number of fitted samples."""
_COLOURED_RESOLUTION = 0.05
"""Further insignificant excess of slow noise: this times the coloured share of the variance of the noise."""
_FORM_ERROR = 0.01
"""Part of the baseline's excess that the correct effect leaves because its form is not exact."""
_UNKNOWN_FORM_ERROR = 0.2
"""Smallest part of the baseline's excess that known effects leave of an unknown cause."""
_LARGE_GAP = 1.0
"""Threshold on the baseline's excess: above it, a set that leaves more than this part of it is incomplete."""
_INPUT_NOISE_EXCESS = 0.03
"""Largest excess that input noise explains [1]."""
_FLOOR_DEVIATIONS = 3.0
"""Error of the noise floor that explains an excess [standard deviations of the floor's variance]."""
_LOGISTIC_WIDTH = 0.25
"""Width of the transition to a significant excess, relative to that excess."""
_COUNT_PRIOR = (0.2, 0.5, 0.25, 0.045, 0.005)
"""Prior probability of no, one, two, ... effects."""
_UNKNOWN_ODDS = 3.0
"""Prior odds of an unknown cause over the most probable set, if both leave as much."""
_COMPLEXITY_FACTOR = 0.1
"""Factor on the prior of each effect for the freedom of its parameters."""
_MISATTRIBUTION = 0.02
"""Probability that a set which closes all of the gap is not the cause."""
_MISATTRIBUTION_SLOPE = 0.4
"""Further probability of that, per part of the gap that the set leaves."""
_RARE_WEIGHT = 0.3
"""Factor on the prior of an effect that is not among the common ones."""

MAX_TIED_SETS = 3
"""Largest number of sets that a proposed stroke separates."""
MIN_TIED_PROBABILITY = 0.05
"""Smallest probability of such a set."""
UNKNOWN_THRESHOLD = 0.5
"""Threshold on the probability of an unknown cause: above it, a gap without a known cause counts as one."""


class BlockEvidence(NamedTuple):
    """Block evidence of a set over another with one effect less, or of a curve over a set."""

    parent: frozenset[str]
    """Names of the set that it is compared with."""
    log_odds: float
    """Natural logarithm of the odds, before the complexity penalty."""


@dataclass(frozen=True)
class SetEvidence:
    """Evidence of one set of effects."""

    names: frozenset[str]
    excess: float
    """Excess of the set, on the worse of fitted and held-out samples [1]."""
    weight: float = 1.0
    """Weight of the sizes of its effects [1]."""
    block_evidence: BlockEvidence | None = None
    """Block evidence, where it was computed."""
    held_out_evidence: tuple[BlockEvidence, ...] = ()
    """Block evidence on the held-out samples over sets with one effect less, where it was computed."""


@dataclass(frozen=True)
class Posterior:
    """Probabilities of the sets of effects and of an unknown cause."""

    sets: dict[frozenset[str], float]
    """Probability of exactly each set."""
    unknown: float
    """Probability of an unknown cause."""

    @property
    def most_probable_set(self) -> frozenset[str]:
        """Names of the effects of the most probable set."""
        return self.rank_sets()[0][0]

    def compute_effect_probability(self, name: str) -> float:
        """Return the probability that an effect is active, alone or with others."""
        return float(sum(p for names, p in self.sets.items() if name in names))

    def rank_sets(self) -> list[tuple[frozenset[str], float]]:
        """Return the sets with their probabilities, the most probable first."""
        return sorted(self.sets.items(), key=lambda item: -item[1])


def compute_posterior(
    sets: Sequence[SetEvidence],
    samples: int,
    coloured_share: float = 0.0,
    curve: SetEvidence | None = None,
    noise_excess: float = 0.0,
) -> Posterior:
    """Compute the probabilities of sets of effects and of an unknown cause.

    Args:
        sets: evidence of every fitted set, the empty one included.
        samples: number of fitted samples.
        coloured_share: part of the variance of the noise [1] that is not white; slow noise varies more by chance.
        curve: evidence of a fitted curve, where it is an alternative to the sets. With the name of an effect it is
            that effect in another form, with another name a cause outside the library.
        noise_excess: largest excess that the uncertainty of the noise floor explains [1].
    """
    gap = max(next(s.excess for s in sets if not s.names), 0.0)
    resolution = (
        _EXCESS_RESOLUTION
        + _RESOLUTION_SAMPLES / max(samples, 1)
        + _COLOURED_RESOLUTION * coloured_share
        + _FORM_ERROR * gap
    )
    scores = _compute_scores(sets, resolution, gap)
    curve_score = -math.inf if curve is None else _score_curve(curve, scores, resolution, gap)
    is_other_form = curve is not None and curve.names in scores
    if curve is not None and is_other_form and curve_score > scores[curve.names]:
        scores[curve.names] = curve_score
        sets = [curve if s.names == curve.names else s for s in sets]
    best = max(sets, key=lambda s: scores[s.names])
    chance = _INPUT_NOISE_EXCESS + _FLOOR_DEVIATIONS * math.sqrt(2.0 / max(samples, 1))
    unknown = _score_unknown(best, gap, resolution, max(chance, noise_excess))
    if not is_other_form:
        unknown = float(np.logaddexp(unknown, curve_score))
    shares = normalise_scores(np.array([*scores.values(), unknown]))
    remaining = (max(best.excess, 0.0) + resolution) / (gap + resolution)
    any_effect = 1.0 - float(shares[list(scores).index(frozenset())])
    misattributed = compute_misattribution(remaining) * any_effect
    known = (1.0 - misattributed) * shares[:-1]
    return Posterior(dict(zip(scores, map(float, known), strict=True)), 1.0 - float(known.sum()))


def _compute_scores(sets: Sequence[SetEvidence], resolution: float, gap: float) -> dict[frozenset[str], float]:
    """Return the log odds of each set, from its excess or from its block evidence, whichever is larger.

    A set with an effect that increases the error on held-out samples is less probable than the set without it.
    """
    prior = {s.names: compute_log_prior(s.names) + math.log(s.weight) for s in sets}
    scores = {s.names: prior[s.names] - _compute_loss(s, resolution, gap) for s in sets}
    with_blocks = [(s.names, s.block_evidence) for s in sets if s.block_evidence]
    for names, (parent, log_odds) in sorted(with_blocks, key=lambda item: len(item[0])):
        scores[names] = max(scores[names], scores[parent] + log_odds + prior[names] - prior[parent])
    for s in sorted(sets, key=lambda s: len(s.names)):
        for parent, log_odds in s.held_out_evidence:
            if log_odds < 0.0:
                scores[s.names] = min(scores[s.names], scores[parent] + log_odds)
    return scores


def _compute_loss(evidence: SetEvidence, resolution: float, gap: float) -> float:
    """Return the loss in log odds that the excess of a set causes."""
    loss = _LIKELIHOOD_EXPONENT * math.log(max(evidence.excess, 0.0) + resolution)
    return loss + _penalise_incomplete(evidence, gap)


def _score_curve(
    curve: SetEvidence, scores: Mapping[frozenset[str], float], resolution: float, gap: float
) -> float:
    """Return the log odds of a curve, from the same evidence as those of a set."""
    prior = compute_log_prior(curve.names)
    score = prior - _compute_loss(curve, resolution, gap)
    if curve.block_evidence is None:
        return score
    parent, log_odds = curve.block_evidence
    return max(score, scores[parent] + log_odds + prior - compute_log_prior(parent))


def _score_unknown(best: SetEvidence, gap: float, resolution: float, insignificant: float) -> float:
    """Return the log odds of an unknown cause, next to the most probable set.

    It is an alternative only where known effects leave an excess that the noise floor cannot explain.
    """
    score = compute_log_prior(best.names) + math.log(_UNKNOWN_ODDS)
    score -= _LIKELIHOOD_EXPONENT * math.log(_UNKNOWN_FORM_ERROR * gap + resolution + insignificant)
    score -= _penalise_incomplete(best, gap)
    weight = _compute_logistic(best.excess - insignificant, _LOGISTIC_WIDTH * insignificant)
    return score + math.log(max(weight, 1e-9))


def _penalise_incomplete(evidence: SetEvidence, gap: float) -> float:
    """Return the loss of a set that leaves more of a large gap than any correct set does."""
    ratio = evidence.excess / (_UNKNOWN_FORM_ERROR * gap) if gap > _LARGE_GAP else 0.0
    return _LIKELIHOOD_EXPONENT * math.log(max(ratio, 1.0))


def compute_misattribution(remaining: float) -> float:
    """Return the probability that a set which leaves a part of the gap [1] is not the cause."""
    return _MISATTRIBUTION + _MISATTRIBUTION_SLOPE * remaining


def compute_complexity_penalty(names: frozenset[str]) -> float:
    """Return the logarithm of the odds that one more common effect has to bring to a set."""
    larger = names | {next(name for name in COMMON_EFFECTS if name not in names)}
    return compute_log_prior(names) - compute_log_prior(larger)


def compute_log_prior(names: frozenset[str]) -> float:
    """Return the logarithm of the prior of a set: that of its size, shared among all sets of this size."""
    count = len(names)
    size_prior = _COUNT_PRIOR[min(count, len(_COUNT_PRIOR) - 1)]
    rare = sum(name not in COMMON_EFFECTS for name in names)
    log_share = math.log(size_prior / math.comb(len(COMMON_EFFECTS), count))
    return log_share + count * math.log(_COMPLEXITY_FACTOR) + rare * math.log(_RARE_WEIGHT)


def _compute_logistic(value: float, width: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(value / width, -40.0), 40.0)))


def normalise_scores(scores: Array) -> Array:
    """Return probabilities that add to one from their logarithms (sets,), which may have a common offset."""
    shares = np.exp(scores - scores.max())
    return np.asarray(shares / shares.sum())


def compute_stage_probabilities(
    posterior: Posterior,
    stages: Sequence[Stage],
    library: Mapping[str, Effect] = MappingProxyType(EFFECTS),
    unlisted: Mapping[Stage, float] | None = None,
) -> dict[Stage, float]:
    """Return the probability of a missing effect at each stage.

    Args:
        posterior: probabilities of the sets of effects and of an unknown cause.
        stages: all stages.
        library: effects of these sets.
        unlisted: probability of each stage if the cause is unknown; equal ones if None.
    """
    unlisted = unlisted or dict.fromkeys(stages, 1.0 / len(stages))
    shares: dict[Stage, float] = {stage: posterior.unknown * unlisted[stage] for stage in stages}
    for names, probability in posterior.sets.items():
        for stage in {library[name].stage for name in names}:
            shares[stage] += probability
    return {stage: min(share, 1.0) for stage, share in shares.items()}
