"""Odds between sets of effects, from what each leaves of the gap.

The likelihood of white noise would be far too sure of itself: with a hundred thousand samples one per cent of
misfit decides everything, while every library's form is wrong by more than that. So the odds follow the *ratio* of
what two sets leave, to a fixed power, down to a grain: the noise of the floor itself, and a small part of the
whole gap that even the right effect leaves because its form is not exact. Fewer effects are preferred beforehand,
and "something that nobody has thought of" is one of the rivals: it is expected to leave what the right known
effects hardly ever do.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.effects import EFFECTS, USUAL
from identification.gap.documents import StageName

_POWER = 6.0
"""[1] how odds follow the ratio of what is left; calibrated on recordings whose effect was known."""
_GRAIN = 0.004
"""[1] excess variance over the floor's that means nothing: noise of the motion carried by the fit."""
_SAMPLES = 10.0
"""[samples] the grain of a short recording: this over its length."""
_COLOURED = 0.05
"""[1] the same of a noise that is slow: for the part of its variance that is."""
_FORM = 0.01
"""[1] part of the whole gap that the right effect leaves because its form is not exact."""
_UNKNOWN_FORM = 0.2
"""[1] part of the whole gap that known effects leave of an unknown one, at best."""
_CLEAR = 1.0
"""[1] whole gap from which on a set that leaves more of it than the right ones do is not the whole truth."""
_UNSURE_FLOOR = 0.03
"""[1] excess over the floor's variance that noise of the motion explains."""
_UNSURE = 3.0
"""[1] standard deviations of the floor's variance that its own error explains."""
_BY_COUNT = (0.2, 0.5, 0.25, 0.045, 0.005)
"""[1] probability beforehand of none, one, two, ... effects."""
_UNKNOWN = 3.0
"""[1] odds beforehand of something else over the likeliest set, where both leave as much."""
_OCCAM = 0.1
"""[1] price of each effect for the freedom of its parameters."""
_DOUBT, _DOUBT_OF_REST = 0.02, 0.4
"""[1] probability that what fits is not the cause: where nothing is left, and more for each part of the gap."""
_RARE = 0.3
"""[1] weight of an effect of the second list."""


class Shown(NamedTuple):
    """What places say of a set over another one that has an effect less."""

    beside: frozenset[str]
    """The other set."""
    log_odds: float
    """Natural logarithm, before the freedom of the effect is paid for."""


@dataclass(frozen=True)
class Candidate:
    """A set of effects and what it leaves."""

    names: frozenset[str]
    left: float
    """[1] excess of its squared error over the floor's variance, the worse of seen and unseen strokes."""
    weight: float = 1.0
    """[1] how plausible the sizes of its effects are."""
    shown: Shown | None = None
    """What places say of it, where it was looked at."""


@dataclass(frozen=True)
class Odds:
    """Probabilities of sets of effects."""

    sets: dict[frozenset[str], float]
    """Of exactly each set."""
    unknown: float
    """That something outside the library is at work."""

    def of_effect(self, name: str) -> float:
        """That an effect is at work, whatever else is."""
        return float(sum(p for names, p in self.sets.items() if name in names))

    def ranked(self) -> list[tuple[frozenset[str], float]]:
        """Sets, the likeliest first."""
        return sorted(self.sets.items(), key=lambda item: -item[1])


def odds(candidates: Sequence[Candidate], samples: int, colour: float = 0.0) -> Odds:
    """Probabilities of sets of effects, and of none of them.

    Args:
        candidates: every set that was fitted, the empty one among them.
        samples: fitted samples.
        colour: part of the noise's variance [1] that is not white: what is slow goes up and down by chance.
    """
    whole = max(next(c.left for c in candidates if not c.names), 0.0)
    grain = _GRAIN + _SAMPLES / max(samples, 1) + _COLOURED * colour + _FORM * whole
    scores = _scores(candidates, grain, whole)
    unsure = _UNSURE_FLOOR + _UNSURE * math.sqrt(2.0 / max(samples, 1))
    likeliest = max(candidates, key=lambda c: scores[c.names])
    unknown = _log_prior(likeliest.names) + math.log(_UNKNOWN)
    unknown -= _POWER * math.log(_UNKNOWN_FORM * whole + grain + unsure)
    unknown -= _incomplete(likeliest, whole)
    # An unknown effect is a rival only as far as the known ones leave something that the floor cannot explain.
    weight = _logistic(likeliest.left - unsure, 0.25 * unsure)
    shares = _normalised(np.array([*scores.values(), unknown + math.log(max(weight, 1e-9))]))
    rest = (max(likeliest.left, 0.0) + grain) / (whole + grain)
    doubt = (_DOUBT + _DOUBT_OF_REST * rest) * (1.0 - float(shares[list(scores).index(frozenset())]))
    known = (1.0 - doubt) * shares[:-1]
    return Odds(dict(zip(scores, map(float, known), strict=True)), 1.0 - float(known.sum()))


def _scores(candidates: Sequence[Candidate], grain: float, whole: float) -> dict[frozenset[str], float]:
    """Logarithms of the odds of sets, from all that they leave and from what places say, whichever says more."""
    prior = {c.names: _log_prior(c.names) + math.log(c.weight) for c in candidates}
    lost = {c.names: _POWER * math.log(max(c.left, 0.0) + grain) + _incomplete(c, whole) for c in candidates}
    scores = {names: prior[names] - lost[names] for names in prior}
    told = [(c.names, c.shown) for c in candidates if c.shown]
    for names, (beside, log_odds) in sorted(told, key=lambda one: len(one[0])):
        scores[names] = max(scores[names], scores[beside] + log_odds + prior[names] - prior[beside])
    return scores


def _incomplete(candidate: Candidate, whole: float) -> float:
    """What a set loses beside other known ones for leaving more of a clear gap than any right one does."""
    beyond = candidate.left / (_UNKNOWN_FORM * whole) if whole > _CLEAR else 0.0
    return _POWER * math.log(max(beyond, 1.0))


def price(names: frozenset[str]) -> float:
    """Logarithm of the odds that one usual effect more has to bring beside a set."""
    more = names | {next(name for name in USUAL if name not in names)}
    return _log_prior(names) - _log_prior(more)


def _log_prior(names: frozenset[str]) -> float:
    """Logarithm of the probability of a set beforehand: by its size, shared among all sets of that size."""
    count = len(names)
    of_size = _BY_COUNT[min(count, len(_BY_COUNT) - 1)]
    rare = sum(name not in USUAL for name in names)
    among = math.log(of_size / math.comb(len(USUAL), count))
    return among + count * math.log(_OCCAM) + rare * math.log(_RARE)


def _logistic(value: float, width: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(value / width, -40.0), 40.0)))


def _normalised(scores: Array) -> Array:
    shares = np.exp(scores - scores.max())
    return np.asarray(shares / shares.sum())


def stage_odds(found: Odds, stages: Sequence[StageName]) -> dict[StageName, float]:
    """Probability of each stage that something is missing there.

    Args:
        found: odds of the sets.
        stages: names of the chain's stages.

    Returns:
        By stage; what is unknown is spread evenly.
    """
    shares: dict[StageName, float] = dict.fromkeys(stages, found.unknown / len(stages))
    for names, probability in found.sets.items():
        for stage in {EFFECTS[name].stage for name in names}:
            shares[stage] += probability
    return {stage: min(share, 1.0) for stage, share in shares.items()}
