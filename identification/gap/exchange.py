"""The best sets once more: with each of their effects left out, and with others in its place.

A search that goes forward keeps what came first, and of play and give the one that it happened to try. What a
second effect seems to gain may only be that the search for the first one had stopped short; and an effect that
came first because two others together look like it would stay.
"""

from typing import TYPE_CHECKING

from identification.effect_choice import EffectChoice
from identification.gap.contender import Contender
from identification.gap.mountings import fit_mounting
from identification.gap.screen import ALWAYS, worth_fitting
from identification.gap.unknowns import without

if TYPE_CHECKING:
    from identification.gap.search import Search

_TAKEN_BACK = 2
"""Sets of several effects that are fitted again with each one left out."""
_EXCHANGED, _EXCHANGES = 2, 2
"""Effects tried in the place of each one of the best set, and how often that is done."""
_BETTER = 0.9
"""[1] part of what the best set left that the better one may leave, for a further exchange."""


def leave_out(search: "Search") -> None:
    """Fit the best sets with each of their effects left out, from where the whole set ended."""
    best = sorted((c for c in search.found.values() if len(c.names) > 1), key=search.left_of)[:_TAKEN_BACK]
    for contender in best:
        for choice in contender.fit.effects:
            left_out(search, contender, choice)


def left_out(search: "Search", contender: Contender, choice: EffectChoice) -> Contender:
    """A set fitted again without one of its effects."""
    rest = tuple(c for c in contender.fit.effects if c != choice)
    return search.fit(rest, None, [without(contender.fit.problem, contender.fit.minimum.unknowns, choice)])


def exchange(search: "Search") -> None:
    """Fit other effects in the place of each one of the best set, where that leaves something."""
    for _ in range(_EXCHANGES):
        best = search.best()
        if len(best.names) < 2 or search.at_floor(best):
            return
        before = search.left_of(best)
        for choice in best.fit.effects:
            if search.late:
                return
            _replace(search, best, choice)
        if search.left_of(search.best()) > _BETTER * before:
            return


def exchange_mounting(search: "Search", names: frozenset[str]) -> None:
    """Fit play in the place of give in a set, or give in that of play, on all samples.

    Neither promises anything by a linear look, and each takes up the most of the other: what stands in a set may
    only have been tried first.
    """
    for given, other in (ALWAYS, ALWAYS[::-1]):
        twin = names - {given} | {other}
        if given not in names or other in names or len(names) < 2 or twin in search.complete:
            continue
        known = search.found[names]
        choice = next(c for c in known.fit.effects if c.name == given)
        rest = _rest(search, known, choice)
        fit_mounting(search, rest, search.screened(rest, names), other)
        if twin in search.found:
            search.polish(twin)


def _rest(search: "Search", contender: Contender, choice: EffectChoice) -> Contender:
    """A set without one of its effects, as it is known or else fitted."""
    return search.found.get(contender.names - {choice.name}) or left_out(search, contender, choice)


def _replace(search: "Search", best: Contender, choice: EffectChoice) -> None:
    """Fit the most promising effects in the place of one."""
    rest = _rest(search, best, choice)
    gains = search.screened(rest, best.names)
    for gain in worth_fitting(gains, _EXCHANGED):
        if rest.names | {gain.choice.name} not in search.found:
            search.fit_beside(rest, gain, [])
