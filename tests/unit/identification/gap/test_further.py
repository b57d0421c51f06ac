"""One effect more beside the likeliest set, asked of places; its kin are not asked."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng

from identification.effect_choice import EffectChoice
from identification.gap.further import look_further
from identification.gap.screen import Gain
from identification.gap.where import Left

RATE, SECONDS, FLOOR = 500.0, 60.0, 1.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
NOISE = FLOOR * default_rng(3).standard_normal(len(TIME))
SLOW = 2.0 * np.exp(-(TIME % 1.0) / 0.2)
FORM = np.where(TIME < 6.0, 2.0, 0.0)


class FurtherSearch:
    """Sets whose names say what they leave: the lag of a coil leaves nothing after the steps of a drive."""

    def __init__(self):
        self.floor, self.none_left = FLOOR, 30.0
        self.found, self.complete, self.shown, self.without = {}, set(), {}, None

    def add(self, names):
        error = FORM + (0.0 if "coil_lag" in names else SLOW)
        left = Left(NOISE + error, 0.0 * TIME, 0.0 * TIME, TIME, np.ones(len(TIME), bool), ((len(TIME), RATE),))
        fit = SimpleNamespace(effects=tuple(map(EffectChoice.of, sorted(names))))
        self.found[names] = SimpleNamespace(fit=fit, left=left, names=names)

    def left_of(self, contender):
        return float(np.mean(contender.left.residual**2)) / FLOOR**2 - 1.0

    def screened(self, parent, without):
        self.without = without
        names = [n for n in ("gas_spring", "coil_lag", "moving_mass") if n not in without]
        return [Gain(EffectChoice.of(n), 0.5, 0.5, np.empty(0)) for n in names]

    def fit_beside(self, parent, gain, values):
        self.add(parent.names | {gain.choice.name})

    def polish(self, names):
        self.complete.add(names)


@pytest.fixture
def further(monkeypatch):
    monkeypatch.setattr(
        "identification.gap.further.left_out",
        lambda search, whole, choice: search.add(whole.names - {choice.name}),
    )
    search = FurtherSearch()
    search.add(frozenset({"end_stop"}))
    return search


def test_an_effect_that_many_places_show_pays_and_its_parts_are_fitted(further):
    assert look_further(further, frozenset({"end_stop"}))
    shown = {tuple(sorted(names)): one.log_odds for names, one in further.shown.items()}
    assert shown[("coil_lag", "end_stop")] > 10.0
    assert shown[("end_stop", "moving_mass")] == pytest.approx(0.0)
    assert frozenset({"coil_lag"}) in further.found


def test_what_the_search_has_grown_already_is_asked_too(further, monkeypatch):
    names, more = frozenset({"end_stop"}), frozenset({"end_stop", "coil_lag"})
    monkeypatch.setattr(further, "screened", lambda parent, without: [])
    further.add(more)
    assert look_further(further, names)
    assert further.complete == {more}


def test_kin_that_the_search_has_grown_has_to_bring_more(further, monkeypatch):
    names, kin = frozenset({"force_filter"}), frozenset({"force_filter", "moving_mass"})
    monkeypatch.setattr(further, "screened", lambda parent, without: [])
    for some in (names, kin):
        further.add(some)
    look_further(further, names)
    assert further.shown[kin].log_odds == pytest.approx(-8.0)


def test_kin_of_what_is_named_are_not_asked(further):
    look_further(further, frozenset({"end_stop"}))
    assert {"end_stop", "gas_spring", "clevis_backlash"} <= further.without
    assert "coil_lag" not in further.without


@pytest.mark.parametrize("why", ["nothing is named", "three are named", "most of the gap is left"])
def test_nothing_further_is_looked_for(further, why):
    names = frozenset({"end_stop"})
    match why:
        case "nothing is named":
            names = frozenset()
        case "three are named":
            names = frozenset({"end_stop", "mains_hum", "moving_mass"})
        case _:
            further.none_left = 1.0
    further.add(names)
    assert not look_further(further, names)
    assert not further.shown
