"""Play and give in the mounting: tried beside a set whatever a linear look promises of them.

Under a wrong yield displacement the law looks nearly as they do, and from there they seem to be worth nothing.
Each begins at several sizes, richer forms only where simpler ones show.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from identification.effect_choice import EffectChoice
from identification.gap.contender import Contender
from identification.gap.screen import Gain

if TYPE_CHECKING:
    from identification.gap.search import Search

_SLIGHT = 0.02
"""[1] excess below which no play is looked for beside other effects."""
_SHOWN = 0.8
"""[1] part of the excess that the simplest form of play or give may leave, for richer ones to be tried."""
_HELPS = 0.97
"""[1] part of the excess that play or give may leave alone, to be tried beside other effects too."""


def may_help(search: "Search", parent: Contender, name: str) -> bool:
    """Whether one is tried beside others without a promise: not where alone it took nothing away."""
    alone = search.found.get(frozenset({name}))
    return not parent.names or alone is None or search.left_of(alone) < _HELPS * search.none_left


def fit_mounting(search: "Search", parent: Contender, gains: Sequence[Gain], name: str) -> None:
    """Fit a set with one of them; ``gains`` are the screening's beside that set."""
    mine = [g for g in gains if g.choice.name == name]
    # A pin that the damper follows and one that lies free differ: neither speaks for the other.
    for acts in dict.fromkeys(g.choice.form.acts for g in mine):
        alike = [g for g in mine if g.choice.form.acts == acts]
        _fit_forms(search, parent, sorted(alike, key=lambda g: len(g.choice.quantities)))


def _fit_forms(search: "Search", parent: Contender, gains: Sequence[Gain]) -> None:
    """Fit a set with its forms, the simplest first, as long as they show."""
    simpler: dict[str, float] = {}
    for gain in gains:
        if parent.names and gain.choice.form.acts == "displacement_follower":
            continue  # its contacts ask for a high rate, and a free pin shows beside others as well
        if search.at_floor(search.best()) or search.left_of(parent) < _SLIGHT:
            return
        starts = [*_begun_with(simpler, gain.choice), *gain.choice.form.starts]
        with_it = search.fit_beside(parent, gain, starts)
        simpler = with_it.fit.values[gain.choice.name]
        if search.left_of(with_it) > _SHOWN * search.left_of(parent):
            return


def _begun_with(simpler: Mapping[str, float], choice: EffectChoice) -> list[tuple[float, ...]]:
    """Starts of a richer form at what a simpler one has found of the parameters that both have."""
    if not simpler:
        return []
    symbols = [q.symbol for q in choice.quantities]
    starts = {tuple(simpler.get(s, v) for s, v in zip(symbols, at, strict=True)) for at in choice.form.starts}
    return sorted(starts)
