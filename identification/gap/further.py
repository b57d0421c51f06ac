"""One effect more beside the likeliest set, once that has been fitted on all samples.

The search goes forward on thinned samples and ends where the error of a form could hide all that is left. Here the
set stands as well as it can, and what the most promising further effects explain is weighed place by place. An
effect's error of form is best taken up by its kin, which act over the same thing: of those no place can tell.
"""

from typing import TYPE_CHECKING

from identification.gap.exchange import left_out
from identification.gap.places import evidence, most
from identification.gap.posterior import Shown, price
from identification.gap.screen import worth_fitting

if TYPE_CHECKING:
    from identification.gap.search import Search

_KIN = (
    {"clevis_backlash", "fixture_compliance", "end_stop", "side_load_friction"},
    {"gas_spring", "end_stop", "side_load_friction", "displacement_nonlinearity"},
    {"seal_friction", "orifice_turbulence", "shear_thinning", "direction_asymmetry"},
    {"field_saturation", "magnetic_remanence", "coil_crosstalk"},
    {"moving_mass", "force_delay", "force_filter", "displacement_delay"},
    {"viscous_heating", "force_drift"},
)
"""Effects that act where a stroke turns, over displacement, velocity, field, acceleration and time."""
_KINSHIP = 8.0
"""[1] natural logarithm of the odds that kin has to bring beyond others: an error of form brought up to six."""
_TRIED = 2
"""Effects that are fitted beside it."""
_MOST = 3
"""Effects that a set may have."""
_EXPLAINS = 0.2
"""[1] part of the gap that a set may leave, for what is left to be sought in one effect more."""


def look_further(search: "Search", names: frozenset[str]) -> bool:
    """Fit the most promising further effects beside a set; whether one of them pays for its freedom."""
    if not _worth_a_look(search, names):
        return False
    kin = set[str]().union(*(alike for alike in _KIN if names & alike))
    paid = []
    for more in _with_one_more(search, names, names | kin):
        search.polish(more)
        told = evidence(search.found[names].left, search.found[more].left)
        search.shown[more] = Shown(names, told - (_KINSHIP if more & kin - names else 0.0))
        paid += [more] if search.shown[more].log_odds > price(names) else []
    for more in paid:
        _fit_parts(search, more)
    return bool(paid)


def _with_one_more(search: "Search", names: frozenset[str], without: frozenset[str]) -> list[frozenset[str]]:
    """Sets with the most promising effects beside a set, and the best that the search has grown from it."""
    known, sets = search.found[names], []
    for gain in worth_fitting(search.screened(known, without), _TRIED):
        sets.append(names | {gain.choice.name})
        if sets[-1] not in search.complete:
            search.fit_beside(known, gain, [])
    grown = [n for n in search.found if len(n) == len(names) + 1 and names < n]
    best = sorted(grown, key=lambda n: search.left_of(search.found[n]))[:1]
    return list(dict.fromkeys([*sets, *best]))


def _worth_a_look(search: "Search", names: frozenset[str]) -> bool:
    """Whether one effect more could pay for its freedom, beside a set that explains the most of the gap."""
    if not 0 < len(names) < _MOST:
        return False
    known = search.found[names]
    explains = search.left_of(known) < _EXPLAINS * search.none_left
    return explains and most(known.left, search.floor) > price(names)


def _fit_parts(search: "Search", names: frozenset[str]) -> None:
    """Fit a set without each of its effects, as far as that has not been done."""
    whole = search.found[names]
    for choice in whole.fit.effects:
        if names - {choice.name} not in search.found:
            left_out(search, whole, choice)
