"""Backlash and compliance are fitted form by form: alone all, with others while each closes part of the gap."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.selection.mounting import fit_mounting, is_mounting_promising
from tests.support.candidate_pools import fit_baseline
from tests.support.effects import active


@pytest.fixture(scope="module")
def joint():
    """A joint whose faces touch under load, with only the law fitted."""
    return fit_baseline(active("fixture_compliance", "closing_joint"))


@pytest.fixture(scope="module")
def pin():
    """A free pin and a gas spring, with the law and the gas spring fitted."""
    pool = fit_baseline("gas_spring", active("clevis_backlash", "free_pin"))
    pool.extend("gas_spring")
    return pool


def fit_forms(pool, name, parent=frozenset()):
    """The names of the forms of a mounting effect that are fitted in addition to a set."""
    pool.fitted.clear()
    fit_mounting(pool, pool.candidates[parent], pool.screen(pool.candidates[parent], parent), name)
    return [effects[-1].form_name for effects in pool.fitted]


def test_a_richer_form_starts_where_a_simpler_one_ended(joint):
    pool = joint.copy(negligible_excess=-1.0, negligible_share=0.0)
    assert fit_forms(pool, "fixture_compliance") == ["linear", "stiffening", "closing_joint"]
    assert pool.get_excess("fixture_compliance") < 0.05
    column = pool.baseline.fit.problem.layout.per_log.start
    compliances = [[unknowns[column] for unknowns in starts] for starts in pool.starts]
    own_starts = [e[-1].to_search(values)[0] for e in pool.fitted for values in e[-1].form.starts]
    assert any(not np.isclose(c, own_starts).any() for c in compliances[1])


def test_alone_every_form_is_fitted_even_where_the_simplest_closes_nothing(pin):
    assert fit_forms(pin.copy(), "fixture_compliance") == ["linear", "stiffening", "closing_joint"]


def test_with_other_effects_no_richer_form_is_fitted_where_the_simplest_closes_too_little(pin):
    pool = pin.copy(richer_form_share=0.0)
    assert fit_forms(pool, "fixture_compliance", frozenset({"gas_spring"})) == ["linear"]


@pytest.mark.parametrize(
    ("gain", "forms"), [(0.21, ["linear", "stiffening", "closing_joint"]), (0.19, ["linear"])]
)
def test_a_richer_form_is_fitted_if_it_is_expected_to_close_what_the_simplest_does_not(pin, gain, forms):
    pool, parent = pin.copy(), frozenset({"gas_spring"})
    found = [
        g for g in pool.screen(pool.candidates[parent], parent) if g.effect_model.name == "fixture_compliance"
    ]
    stated = {"stiffening": gain}
    gains = [
        replace(g, predicted_gain=(value := stated.get(g.effect_model.form_name, 0.0)), achieved_gain=value)
        for g in found
    ]
    fit_mounting(pool, pool.candidates[parent], gains, "fixture_compliance")
    assert [effects[-1].form_name for effects in pool.fitted] == forms


def test_every_action_of_backlash_is_tried_alone(pin):
    assert {"backlash", "free_pin"} <= set(fit_forms(pin.copy(), "clevis_backlash"))


def test_only_a_free_pin_is_tried_with_other_effects(pin):
    forms = fit_forms(pin.copy(), "clevis_backlash", frozenset({"gas_spring"}))
    assert forms[0] == "free_pin"
    assert "backlash" not in forms


def test_no_mounting_effect_is_fitted_at_a_small_excess(joint):
    assert fit_forms(joint.copy(mounting_excess=1e3), "fixture_compliance") == []


@pytest.mark.parametrize(("share", "promising"), [(1e-3, False), (1.0, True)])
def test_a_mounting_effect_that_closed_nothing_alone_is_not_tried_with_others(pin, share, promising):
    pool = pin.copy(helpful_mounting_share=share)
    gas = pool.candidates[frozenset({"gas_spring"})]
    assert is_mounting_promising(pool, gas, "clevis_backlash")
    fit_forms(pool, "clevis_backlash")
    assert is_mounting_promising(pool, gas, "clevis_backlash") == promising
    assert is_mounting_promising(pool, pool.baseline, "clevis_backlash")
