"""Which sets of effects are fitted: forward from the best, side by side, and back again.

Every effect is screened, the best are fitted together with the law, and the two best ends are each taken further
with a second effect, the better end with a third. Then every effect of a set is left out once, so that each set
stands beside all those it grew from. All of it on thinned data; the odds decide what is worth a full fit.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.arrays import Array
from identification.damper.effects import EFFECTS
from identification.effect_choice import EffectChoice
from identification.gap.explain import Effort, JointFit, fit_with
from identification.gap.judge import Judge
from identification.gap.plausible import plausibility
from identification.gap.posterior import Candidate
from identification.gap.screen import ALWAYS, Gain, every_choice, screen
from identification.gap.where import Left
from identification.problem import Problem

_THIN_RATE = 250.0
"""[Hz] below which recordings are not thinned."""
_SCREEN_RATE = 125.0
"""[Hz] of the first look."""
_SWIFT = ("mains_hum",)
"""Effects that the rate of the first look would not carry."""
_FITTED = (6, 4, 2)
"""Effects fitted beside none, one and two others."""
_BEAM = (2, 1)
"""Sets that are taken further, of one and of two effects."""
_OPEN = 1.1
"""[1] RMSE over the floor from which on the gap on one side is large enough to speak of shares of it."""
_WORTH = 0.9
"""[1] part of the excess that may remain for a set to be worth taking further."""
_RIVAL = 3.0
"""[1] multiple of what the best set leaves up to which another is taken further too."""
_TAKEN_BACK = 2
"""Sets of several effects that are fitted again with each one left out."""
_PROMISING = 0.02
"""[1] part of the excess that a screening must promise."""
_ENOUGH = 0.004
"""[1] excess over the floor's variance at which nothing is left to look for."""
_ENOUGH_OF_WHOLE = 0.004
"""[1] the same as a part of the whole gap."""
_FORMS_TIED = 0.7
"""[1] part of the best form's promise from which on another form of the same effect is fitted too."""

Progress = Callable[[str, float], None]
_QUICK = Effort(thin=1, starts=4, descents=1, iterations=25, polish=False)
_SLOW = Effort(thin=1, starts=6, descents=2, iterations=40, polish=False)


@dataclass(frozen=True)
class Contender:
    """A set of effects, fitted."""

    fit: JointFit
    left: Left
    """What it leaves of the force, on all samples."""
    seen: float
    """[N] RMSE on the fitted strokes."""
    unseen: float
    """[N] on those kept out."""
    chance: float
    """[1] excess on those kept out that chance may show."""

    @property
    def names(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset(choice.name for choice in self.fit.effects)

    def share_of(self, none: "Contender", floor: float) -> float:
        """Its excess [1], as the worse share of the gap on seen and on unseen strokes.

        The gap itself may be larger on one side; a set that hides it on seen strokes alone must not gain by it.
        """
        whole = none.excess(floor)
        sides = [(self.seen, none.seen), (self.unseen, none.unseen)]
        shares = [(rms**2 - floor**2) / (plain**2 - floor**2) for rms, plain in sides if plain > _OPEN * floor]
        return max(shares) * whole if len(shares) == len(sides) else self.excess(floor)

    def excess(self, floor: float) -> float:
        """What it leaves beyond the floor's variance [1], the worse of seen and unseen strokes beyond chance."""
        return max((self.seen / floor) ** 2, (self.unseen / floor) ** 2 - self.chance) - 1.0


@dataclass
class Search:
    """The sets that were fitted to one recording."""

    full: Problem
    """All samples that may be fitted."""
    judge: Judge
    floor: float
    """[N]"""
    progress: Progress = lambda what, error: None
    found: dict[frozenset[str], Contender] = field(default_factory=dict)
    complete: set[frozenset[str]] = field(default_factory=set)
    """Sets that were fitted on all samples."""

    def run(self) -> None:
        """Fit what is worth it; ``found`` holds the best of each set."""
        none = self.fit(())
        if self.at_floor(none):
            return
        beam = [none]
        for size, count in enumerate(_FITTED, 1):
            if self.at_floor(beam[0]):
                break
            for parent in beam:
                self._grow(parent, count)
            grown = sorted((c for n, c in self.found.items() if len(n) == size), key=self.left_of)
            if not grown or size > len(_BEAM) or self.left_of(grown[0]) > _WORTH * self.left_of(beam[0]):
                break
            limit = _RIVAL * max(self.left_of(grown[0]), _ENOUGH)
            near = [c for c in grown if self.left_of(c) < limit]
            beam = near[: _BEAM[size - 1]]
        self._back()

    def left_of(self, contender: Contender) -> float:
        """Its excess over the floor [1]."""
        return contender.excess(self.floor)

    def at_floor(self, contender: Contender) -> bool:
        """Whether nothing is left to look for."""
        whole = self.left_of(self.found[frozenset()])
        return self.left_of(contender) < _ENOUGH + _ENOUGH_OF_WHOLE * max(whole, 0.0)

    def best(self) -> Contender:
        """What leaves least."""
        return min(self.found.values(), key=self.left_of)

    def candidates(self) -> list[Candidate]:
        """Every set with what it leaves, against a floor that no set undercuts."""
        lowest = min(min(c.seen, c.unseen) for c in self.found.values())
        floor, none = min(self.floor, lowest), self.found[frozenset()]
        x = np.concatenate([p.stroke.displacement for p in self.full.pieces])
        return [
            Candidate(names, c.share_of(none, floor), math.prod(plausibility(e, x) for e in c.fit.active))
            for names, c in self.found.items()
        ]

    def fit(
        self,
        effects: tuple[EffectChoice, ...],
        start: JointFit | None = None,
        further: Sequence[Array] = (),
        effort: Effort = _QUICK,
    ) -> Contender:
        """Fit a set on thinned data, judge it on all, and keep it if it is the best of its names."""
        contender = self.judged(fit_with(self._thin, effects, start, effort, further))
        self.progress(" and ".join(c.name for c in effects) or "the law alone", contender.unseen)
        known = self.found.get(contender.names)
        if known is None or self.left_of(contender) < self.left_of(known):
            self.found[contender.names] = contender
        return self.found[contender.names]

    def judged(self, fit: JointFit) -> Contender:
        """What a fit leaves on all samples."""
        forces = self.full.with_effects(fit.effects).simulate(fit.minimum.unknowns)
        left = self.judge.left(forces)
        chance = 2.0 * math.sqrt(2.0 / max(int(np.count_nonzero(self.judge.unseen)), 1))
        return Contender(fit, left, *self.judge.rmse(left), chance)

    def _polished(self, contender: Contender) -> Contender:
        """The same set, fitted on all samples."""
        effort = Effort(thin=1, starts=1, descents=1, iterations=15, default_start=False)
        return self.judged(
            fit_with(self.full, contender.fit.effects, None, effort, [contender.fit.minimum.unknowns])
        )

    @property
    def _thin(self) -> Problem:
        rate = max(p.stroke.rate for p in self.full.pieces)
        return self.full.quicker().coarser(max(1, round(rate / _THIN_RATE)))

    def _grow(self, parent: Contender, count: int) -> None:
        """Fit a set with each of the most promising further effects."""
        thin = self._thin
        rate = max(p.stroke.rate for p in thin.pieces)
        names = [n for n in EFFECTS if n not in parent.names]
        slow = [c for c in every_choice(names) if c.name not in _SWIFT]
        swift = [c for c in every_choice(names) if c.name in _SWIFT]
        gains = screen(thin, parent.fit, slow, thin=max(1, round(rate / _SCREEN_RATE)))
        gains += screen(thin, parent.fit, swift, thin=1) if swift else []
        always = () if parent.names else ALWAYS
        for gain in _worth_fitting(gains, count, always):
            effects = (*parent.fit.effects, gain.choice)
            self.fit(effects, parent.fit, [gain.unknowns])

    def _back(self) -> None:
        """The best sets with each of their effects left out, begun where the whole set ended.

        What a second effect seems to gain may only be that the search for the first one had stopped short.
        """
        best = sorted((c for c in self.found.values() if len(c.names) > 1), key=self.left_of)[:_TAKEN_BACK]
        for contender in best:
            for choice in contender.fit.effects:
                rest = tuple(c for c in contender.fit.effects if c != choice)
                self.fit(rest, None, [_without(contender.fit, choice)])

    def polish(self, names: frozenset[str]) -> None:
        """Fit a set on all samples, once, from where it ended on thinned ones."""
        if names not in self.complete:
            self.found[names] = self._polished(self.found[names])
            self.complete.add(names)


def _without(fit: JointFit, left_out: EffectChoice) -> Array:
    """Unknowns of a fit without those of one of its effects."""
    at, kept = fit.problem.first_effect, [fit.minimum.unknowns[: fit.problem.first_effect]]
    for choice in fit.effects:
        if choice != left_out:
            kept.append(fit.minimum.unknowns[at : at + len(choice.quantities)])
        at += len(choice.quantities)
    return np.concatenate(kept)


def _worth_fitting(gains: Sequence[Gain], count: int, always: Sequence[str]) -> list[Gain]:
    """The most promising effects, each in its best form and in forms that promise nearly as much."""
    best: dict[str, list[Gain]] = {}
    for gain in gains:
        best.setdefault(gain.choice.name, []).append(gain)

    def promise(gain: Gain) -> float:
        return max(gain.gain, gain.achieved)

    ranked = sorted(best, key=lambda name: -promise(best[name][0]))
    chosen = [n for n in ranked[:count] if promise(best[n][0]) > _PROMISING]
    chosen += [n for n in always if n in best and n not in chosen]
    return [
        gain
        for name in chosen
        for gain in best[name]
        if gain is best[name][0] or promise(gain) > _FORMS_TIED * promise(best[name][0])
    ]


def fitted_problem(problem: Problem, judge: Judge) -> Problem:
    """The problem with what is kept out of every fit unmarked."""
    return replace(problem, pieces=judge.fitted_pieces())
