"""Which sets of effects are fitted: forward from the best, side by side, and back again.

Every effect is screened, the best are fitted together with the law, and the two best ends are each taken further
with a second effect, the better end with a third. Then every effect of a set is left out once, so that each set
stands beside all those it grew from. Where the best set leaves something, others are tried in the place of each of
its effects: the first was chosen while the rest was missing. All of it on thinned data; the odds decide what is
worth a full fit.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.effect_choice import EffectChoice
from identification.gap.clocks import nothing_but_clocks, steadied
from identification.gap.contender import Contender
from identification.gap.exchange import exchange, leave_out
from identification.gap.explain import Effort, JointFit, fit_on_all, fit_with
from identification.gap.hearing import NOTHING, Hearing
from identification.gap.hum import strongest_line
from identification.gap.judge import Judge
from identification.gap.mountings import fit_mounting, may_help
from identification.gap.plausible import plausibility
from identification.gap.posterior import Candidate, Odds, Shown, odds
from identification.gap.residual import by_piece
from identification.gap.screen import ALWAYS, Gain, promise, worth_fitting
from identification.gap.screenings import SCREEN_RATE, Screenings
from identification.problem import Problem
from identification.start import starting_points

_THIN_RATE = 250.0
"""[Hz] below which recordings are not thinned; long ones are, down to the rate of a screening."""
_MANY = 15_000
"""[samples] above which a recording is thinned further."""
_FITTED = (6, 4, 2)
"""Effects fitted beside none, one and two others."""
_LARGE, _MORE = 2.0, 10
"""[1] excess from which on a step from the law's own fit tells little, and effects fitted beside none then."""
_MOST_FITS = 60
"""Fits after which no further set is begun; the 27 withheld recordings need 43 at most."""
_BEAM = (2, 1)
"""Sets that are taken further, of one and of two effects."""
_WORTH = 0.9
"""[1] part of the excess that may remain for a set to be worth taking further."""
_RIVAL = 3.0
"""[1] multiple of what the best set leaves up to which another is taken further too."""
_ENOUGH = 0.005
"""[1] excess over the floor's variance at which nothing is left to look for."""
_ENOUGH_OF_WHOLE = 0.012
"""[1] the same as a part of the whole gap: a further effect could not pay for its freedom in the odds."""
_SMALL = 0.05
"""[1] excess up to which an effect has to promise a fair part of it, to be worth a fit."""
_FAIR = 0.15
"""[1] that part."""
_POLISHED, _ROUNDS = 15, 3
"""Most steps on all samples, and how often what they hold is taken anew."""
_HELD = 1e-3
"""[1] of the floor by which what they hold may be off."""
Progress = Callable[[str, float], None]
_STAGED = Effort(
    thin=1, starts=0, descents=2, iterations=25, default_start=False, look=2, settling=5, polish=False
)
_PLAIN = Effort(thin=1, starts=1, descents=1, iterations=40, polish=False)
_QUICK = Effort(thin=1, starts=0, descents=1, iterations=25, default_start=False, polish=False)


@dataclass
class Search:
    """The sets that were fitted to one recording."""

    full: Problem
    """All samples that may be fitted."""
    judge: Judge
    hearing: Hearing
    """What counts as noise so far."""
    clocks: float = 0.0
    """[s] to which the log says that its channels' clocks are known; 0 where that is good enough."""
    progress: Progress = lambda what, error: None
    found: dict[frozenset[str], Contender] = field(default_factory=dict)
    complete: set[frozenset[str]] = field(default_factory=set)
    """Sets that were fitted on all samples."""
    shown: dict[frozenset[str], Shown] = field(default_factory=dict)
    """What places say of one effect more."""
    fit_count: int = 0
    """Fits so far."""
    notes: list[str] = field(default_factory=list)
    """What a person should know of the way, in words."""
    _screenings: Screenings = field(default_factory=Screenings)

    def run(self) -> None:
        """Fit what is worth it; ``found`` holds the best of each set."""
        none = self.fit((), effort=_PLAIN)
        self.hearing.listen(none, self.full, self.judge)
        if self.at_floor(none) or self._nothing(none) or self._clocks_explain(none):
            return
        beam = [none]
        for size, count in enumerate(_FITTED, 1):
            if self.late or self.at_floor(beam[0]):
                break
            for parent in beam:
                self._grow(parent, count)
            grown = sorted((c for n, c in self.found.items() if len(n) == size), key=self.left_of)
            if not grown or size > len(_BEAM) or not self._worth_it(grown[0], beam[0]):
                break
            self.hearing.listen(grown[0], self.full, self.judge)
            limit = _RIVAL * max(self.left_of(grown[0]), _ENOUGH)
            near = [c for c in grown if self.left_of(c) < limit]
            beam = near[: _BEAM[size - 1]]
        leave_out(self)
        exchange(self)

    def _nothing(self, none: Contender) -> bool:
        """Whether the law alone stands so near the floor that nothing is looked for."""
        return max(none.seen, none.unseen) < NOTHING * self.floor

    def _clocks_explain(self, none: Contender) -> bool:
        """Whether nothing is left once the force's delay may bend as far as the log's clocks allow."""
        if not self.clocks:
            return False
        steady, wander = steadied(none, self.full, self.judge, self.clocks)
        if self._nothing(steady):
            self.found[steady.names] = steady
            self.complete.add(steady.names)
            self.notes.append(nothing_but_clocks(wander))
        return steady.names in self.complete

    @property
    def late(self) -> bool:
        """Whether enough sets have been fitted; a count gives the same answer on every machine."""
        return self.fit_count >= _MOST_FITS

    def _worth_it(self, best: Contender, parent: Contender) -> bool:
        """Whether a set is worth taking further; where the gap is large, one effect alone may show little."""
        left = self.left_of(best)
        return left < _WORTH * self.left_of(parent) or (not parent.names and left > _LARGE)

    @property
    def floor(self) -> float:
        """[N] what no effect explains."""
        return self.hearing.floor

    def left_of(self, contender: Contender) -> float:
        """Its excess over the floor [1]."""
        return contender.excess(self.floor)

    def at_floor(self, contender: Contender) -> bool:
        """Whether nothing is left to look for."""
        return self.left_of(contender) < _ENOUGH + _ENOUGH_OF_WHOLE * max(self.none_left, 0.0)

    def best(self) -> Contender:
        """What leaves least."""
        return min(self.found.values(), key=self.left_of)

    def candidates(self) -> list[Candidate]:
        """Every set with what it leaves, against a floor that no set undercuts."""
        part = float(np.mean(self.judge.unseen[self.judge.usable]))
        lowest = min(math.sqrt((1.0 - part) * c.seen**2 + part * c.unseen**2) for c in self.found.values())
        floor, none = min(self.floor, lowest), self.found[frozenset()]
        x = np.concatenate([p.stroke.displacement for p in self.full.pieces])
        return [
            Candidate(
                names,
                c.share_of(none, floor),
                math.prod(plausibility(e, x) for e in c.fit.active),
                self.shown.get(names),
            )
            for names, c in self.found.items()
        ]

    def odds(self) -> Odds:
        """Of the sets that were fitted."""
        return odds(self.candidates(), self.full.samples, self.hearing.colour)

    def fit(
        self,
        effects: tuple[EffectChoice, ...],
        start: JointFit | None = None,
        further: Sequence[Array] = (),
        effort: Effort = _QUICK,
    ) -> Contender:
        """Fit a set on thinned data, judge it on all, and keep it if it is the best of its names."""
        self.fit_count += 1
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
        for _ in range(_ROUNDS):
            simulated = by_piece(contender.left.simulated, self.full.pieces)
            fit = fit_on_all(self.full, contender.fit, simulated, _POLISHED)
            contender = self.judged(fit)
            if abs(contender.seen - fit.rmse) < _HELD * self.floor:
                break
        return contender

    @cached_property
    def _thin(self) -> Problem:
        rate = max(p.stroke.rate for p in self.full.pieces)
        samples = sum(len(p.force) for p in self.full.pieces)
        times = min(max(rate / _THIN_RATE, samples / _MANY), rate / SCREEN_RATE)
        return self.full.quicker().coarser(max(1, round(times)))

    def _grow(self, parent: Contender, count: int) -> None:
        """Fit a set with each of the most promising further effects."""
        gains = self.screened(parent, parent.names)
        if not parent.names and self.left_of(parent) > _LARGE:
            count = _MORE
        if self.left_of(parent) < _SMALL and promise(gains[0]) < _FAIR:
            return
        for gain in worth_fitting(gains, count):
            if self.late:
                return
            self.fit_beside(parent, gain, [])
        for name in ALWAYS:
            if not self.late and may_help(self, parent, name):
                fit_mounting(self, parent, gains, name)

    def screened(self, parent: Contender, without: frozenset[str]) -> list[Gain]:
        """What every further effect promises beside a set; those named are not looked at."""
        return self._screenings.beside(parent, without, self.left_of(parent), self._thin, self._line)

    @property
    def none_left(self) -> float:
        """What the law alone leaves beyond the floor [1]."""
        return self.left_of(self.found[frozenset()])

    def fit_beside(self, parent: Contender, gain: Gain, values: Sequence[tuple[float, ...]]) -> Contender:
        """A set with a further effect, fitted from its screening's end and with further values of it."""
        # Under a wrong law the coordinates have moved to where they hide an effect: begin elsewhere, too.
        first, at = self._thin.first_effect, parent.fit.problem.first_own
        elsewhere = np.concatenate([self._regression[:first], gain.unknowns[first:]])
        starts = [elsewhere.copy() for _ in values]
        for start, tried in zip(starts, values, strict=True):
            start[at : at + len(tried)] = gain.choice.to_search(tried)
        effort = _STAGED if values else _QUICK
        return self.fit((*parent.fit.effects, gain.choice), None, [gain.unknowns, elsewhere, *starts], effort)

    @cached_property
    def _regression(self) -> Array:
        """(U,) unknowns of the plain law that the regression gives."""
        return starting_points(self._thin)[0]

    def _line(self, parent: Contender) -> float:
        """Frequency [Hz] of a hum in what a set leaves of the longest stretch."""
        counts = [len(p.force) for p in self.full.pieces]
        longest = counts.index(max(counts))
        part = slice(sum(counts[:longest]), sum(counts[: longest + 1]))
        error = np.where(parent.left.valid, parent.left.residual, 0.0)[part]
        return strongest_line(error, self.full.pieces[longest].stroke.rate)

    def polish(self, names: frozenset[str]) -> None:
        """Fit a set on all samples, once, from where it ended on thinned ones."""
        if names not in self.complete:
            self._finish(names)
            self.found[names] = self._polished(self.found[names])
            self.complete.add(names)

    def _finish(self, names: frozenset[str]) -> None:
        """Let a descent that ran out of steps go on."""
        for _ in range(_ROUNDS):
            known = self.found[names]
            if known.fit.converged or self.late:
                return
            self.fit(known.fit.effects, None, [known.fit.minimum.unknowns])
