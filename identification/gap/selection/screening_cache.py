"""Cache of screenings.

The gains of further effects are needed several times for the same set: when it grows, in exchanges, and in
extensions at the end. A screening contains unknowns of the joint problem of its set. It is therefore valid while
the forms and the order of the set's effects stay the same. The excess of the set must also stay nearly the same.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from identification.damper.effects import Effect
from identification.fitting import EffectModel, Problem
from identification.gap.fits import Candidate
from identification.gap.selection.screening import ScreeningResult, list_effect_models, screen

_CACHE_TOLERANCE = 0.05
"""Relative change of a set's excess within which its screening holds."""


class _Screening(NamedTuple):
    """Gains in addition to one set."""

    effects: tuple[EffectModel, ...]
    """Effects of the set at the time, in their order."""
    excess: float
    """Excess of the set at the time [1]."""
    names: frozenset[str]
    """Names of the screened effects."""
    gains: list[ScreeningResult]

    def is_valid(self, parent: Candidate, excess: float, wanted: frozenset[str]) -> bool:
        """Return True if the gains of the wanted effects still hold for a set with an excess [1]."""
        is_near = abs(excess - self.excess) <= _CACHE_TOLERANCE * self.excess
        return is_near and self.effects == parent.fit.effects and wanted <= self.names


@dataclass
class ScreeningCache:
    """Screenings of a search, by the names of the sets."""

    rate: float
    """Sampling rate of a screening [Hz]."""
    library: Mapping[str, Effect]
    """Effects that are screened."""
    _entries: dict[frozenset[str], _Screening] = field(default_factory=dict)

    def find_gains(
        self,
        parent: Candidate,
        without: frozenset[str],
        excess: float,
        problem: Problem,
        find_mains_frequency: Callable[[Candidate], float],
    ) -> list[ScreeningResult]:
        """Return the gains of further effects in addition to a set, the form with the largest first.

        Args:
            parent: the set.
            without: names of effects that are not screened.
            excess: excess of the set [1].
            problem: decimated data.
            find_mains_frequency: finds the mains frequency [Hz] in the residual of a set.
        """
        wanted = frozenset(self.library) - without
        entry = self._entries.get(parent.names)
        if entry is None or not entry.is_valid(parent, excess, wanted):
            highest = max(p.excitation.rate for p in problem.pieces)
            names = [name for name in self.library if name in wanted]
            models = list_effect_models(names, problem.space.scales.damper_size, self.library)
            decimation = max(1, round(highest / self.rate))
            gains = screen(problem, parent.fit, models, decimation, find_mains_frequency(parent))
            entry = self._entries[parent.names] = _Screening(parent.fit.effects, excess, wanted, gains)
        return [gain for gain in entry.gains if gain.effect_model.name in wanted]
