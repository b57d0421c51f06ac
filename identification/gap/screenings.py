"""Screenings that were made: what every further effect promises beside a set is asked more than once.

A set is grown, effects are exchanged in it, and one more is looked for in the end. Its screening holds as long as
the set leaves what it left then.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from identification.damper.effects import EFFECTS
from identification.gap.contender import Contender
from identification.gap.screen import Gain, every_choice, screen
from identification.problem import Problem

SCREEN_RATE = 125.0
"""[Hz] of the look."""
_AS_BEFORE = 0.05
"""[1] part by which what a set leaves may have changed for its screening to hold."""


class _Screening(NamedTuple):
    """What was promised beside a set."""

    left: float
    """[1] what the set left."""
    names: frozenset[str]
    """Of the effects that were looked at."""
    gains: list[Gain]


@dataclass
class Screenings:
    """The screenings of a search, by the effects of the set beside which they were made."""

    _made: dict[frozenset[str], _Screening] = field(default_factory=dict)

    def beside(
        self,
        parent: Contender,
        without: frozenset[str],
        left: float,
        problem: Problem,
        line: Callable[[Contender], float],
    ) -> list[Gain]:
        """What further effects promise beside a set, the most promising form first.

        Args:
            parent: the set.
            without: effects that are not looked at.
            left: what the set leaves [1].
            problem: thinned samples.
            line: frequency [Hz] at which a hum is looked for in what a set leaves.
        """
        wanted = frozenset(EFFECTS) - without
        made = self._made.get(parent.names)
        if made is None or not wanted <= made.names or abs(left - made.left) > _AS_BEFORE * made.left:
            rate = max(p.stroke.rate for p in problem.pieces)
            choices = every_choice([name for name in EFFECTS if name in wanted])
            gains = screen(problem, parent.fit, choices, max(1, round(rate / SCREEN_RATE)), line(parent))
            made = self._made[parent.names] = _Screening(left, wanted, gains)
        return [gain for gain in made.gains if gain.choice.name in wanted]
