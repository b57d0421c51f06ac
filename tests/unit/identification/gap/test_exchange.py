"""An effect that came first because two others together look like it does not stay."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.effect_choice import EffectChoice
from identification.gap.exchange import exchange, exchange_mounting, leave_out
from identification.gap.screen import Gain

ENOUGH = 0.01


class MadeUpSearch:
    """Sets that leave what a table says; the screening promises what leaves least."""

    def __init__(self, left, late=False):
        self._left, self.late, self.found, self.asked = left, late, {}, []
        self.complete = set()

    def left_of(self, contender):
        return self._left(contender.names)

    def at_floor(self, contender):
        return self.left_of(contender) < ENOUGH

    def best(self):
        return min(self.found.values(), key=self.left_of)

    def fit(self, effects, start=None, further=()):
        assert all(len(u) == 15 + sum(len(e.quantities) for e in effects) for u in further)
        count = sum(len(e.quantities) for e in effects)
        fit = SimpleNamespace(
            effects=effects,
            problem=SimpleNamespace(first_effect=15, effects=effects),
            minimum=SimpleNamespace(unknowns=np.zeros(15 + count)),
        )
        contender = SimpleNamespace(fit=fit, names=frozenset(e.name for e in effects))
        self.asked.append(contender.names)
        return self.found.setdefault(contender.names, contender)

    def screened(self, parent, without):
        names = sorted({"gas_spring", "end_stop", "coil_lag", "moving_mass", "force_drift"} - without)
        looks = [(1.0 - self._left(parent.names | {n}), n) for n in names]
        return [Gain(EffectChoice.of(n), g, g, np.empty(0)) for g, n in sorted(looks, reverse=True)]

    def polish(self, names):
        self.complete.add(names)

    def fit_beside(self, parent, gain, values):
        return self.fit((*parent.fit.effects, gain.choice))


def left_by(truth, alike):
    """What a set leaves [1]: a fifth for each effect that is missing, half of that where one like it stands in."""

    def left(names):
        return sum(0.1 if alike.get(name) in names else 0.2 for name in truth - names)

    return left


@pytest.fixture
def mountings(monkeypatch):
    """A mounting is fitted as it comes."""
    monkeypatch.setattr(
        "identification.gap.exchange.fit_mounting",
        lambda search, rest, gains, name: search.fit((*rest.fit.effects, EffectChoice.of(name))),
    )


def searched(left, *first, late=False):
    search = MadeUpSearch(left, late)
    search.fit(tuple(map(EffectChoice.of, first)))
    leave_out(search)
    exchange(search)
    return search


def test_what_looked_like_two_effects_gives_its_place_to_one_of_them():
    truth = frozenset({"coil_lag", "gas_spring", "moving_mass"})
    search = searched(left_by(truth, {"gas_spring": "end_stop"}), "end_stop", "coil_lag", "moving_mass")
    assert search.best().names == truth


def test_two_places_are_changed_one_after_the_other():
    truth = frozenset({"gas_spring", "moving_mass"})
    search = searched(left_by(truth, {}), "end_stop", "coil_lag")
    assert search.best().names == truth


def test_nothing_is_tried_at_the_floor_or_when_time_is_up():
    truth = frozenset({"gas_spring", "moving_mass"})
    at_floor = searched(left_by(truth, {}), "gas_spring", "moving_mass")
    late = searched(left_by(truth, {}), "end_stop", "coil_lag", late=True)
    assert len(at_floor.asked) == len(late.asked) == 3


@pytest.mark.usefixtures("mountings")
@pytest.mark.parametrize(
    ("given", "other"),
    [("clevis_backlash", "fixture_compliance"), ("fixture_compliance", "clevis_backlash")],
)
def test_play_is_tried_in_the_place_of_give_and_give_in_that_of_play(given, other):
    search = searched(left_by(frozenset({other, "gas_spring"}), {other: given}), "gas_spring", given)
    exchange_mounting(search, frozenset({"gas_spring", given}))
    assert search.best().names == {"gas_spring", other}
    assert search.complete == {frozenset({"gas_spring", other})}


@pytest.mark.parametrize(
    "named", [("gas_spring", "coil_lag"), ("clevis_backlash",), ("clevis_backlash", "fixture_compliance")]
)
def test_a_set_without_a_mounting_to_exchange_stays_as_it_is(named):
    search = searched(left_by(frozenset(named), {}), *named)
    before = list(search.asked)
    exchange_mounting(search, frozenset(named))
    assert search.asked == before
