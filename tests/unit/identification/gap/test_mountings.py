"""Play and give are tried form by form: a richer one where a simpler one shows, and from where that one ended."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.effect_choice import EffectChoice
from identification.gap.mountings import fit_mounting, may_help
from identification.gap.screen import Gain

ENDED = 1.7e-7


class MountingSearch:
    """Sets that leave what their last form says; every fit ends at one compliance."""

    none_left = 2.0

    def __init__(self, left):
        self._left, self.found, self.asked = left, {}, []

    def left_of(self, contender):
        return contender.left

    def best(self):
        return SimpleNamespace(left=1.0)

    def at_floor(self, contender):
        return contender.left < 0.01

    def fit_beside(self, parent, gain, values):
        self.asked.append((gain.choice.form_name, list(values)))
        return SimpleNamespace(
            left=self._left[gain.choice.form_name],
            fit=SimpleNamespace(values={gain.choice.name: {"compliance": ENDED}}),
        )


def beside(*names, left=1.0):
    return SimpleNamespace(names=frozenset(names), left=left)


def looks(name, *forms):
    return [Gain(EffectChoice(name, form), 0.0, 0.0, np.empty(0)) for form in forms]


def test_a_richer_form_begins_where_a_simpler_one_ended():
    search = MountingSearch({"linear": 0.5, "stiffening": 0.4, "closing": 0.3})
    fit_mounting(
        search, beside(), looks("fixture_compliance", "closing", "stiffening", "linear"), "fixture_compliance"
    )
    assert [form for form, _ in search.asked] == ["linear", "stiffening", "closing"]
    assert all(ENDED not in values for values in search.asked[0][1])
    assert any(values[0] == ENDED for values in search.asked[1][1])


def test_nothing_richer_is_tried_where_the_simplest_does_not_show():
    search = MountingSearch({"linear": 0.95})
    fit_mounting(search, beside(), looks("fixture_compliance", "linear", "stiffening"), "fixture_compliance")
    assert [form for form, _ in search.asked] == ["linear"]


def test_beside_other_effects_a_pin_lies_free_and_the_damper_follows_none():
    search = MountingSearch({"play": 0.5, "free_pin": 0.9})
    fit_mounting(search, beside("gas_spring"), looks("clevis_backlash", "play", "free_pin"), "clevis_backlash")
    assert [form for form, _ in search.asked] == ["free_pin"]


@pytest.mark.parametrize(("alone", "helps"), [(1.99, False), (1.0, True)])
def test_what_took_nothing_away_alone_is_not_tried_beside_others(alone, helps):
    search = MountingSearch({})
    assert may_help(search, beside("gas_spring"), "clevis_backlash")
    search.found[frozenset({"clevis_backlash"})] = beside("clevis_backlash", left=alone)
    assert may_help(search, beside("gas_spring"), "clevis_backlash") == helps
    assert may_help(search, beside(), "clevis_backlash")
