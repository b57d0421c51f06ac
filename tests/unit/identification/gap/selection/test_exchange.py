"""An effect that came first because two others together look like it is exchanged."""

import pytest

from identification.gap.selection.exchange import exchange_effects, exchange_mounting, fit_subsets
from identification.gap.selection.mounting import fit_mounting
from tests.support.candidate_pools import fit_baseline
from tests.support.effects import active


@pytest.fixture(scope="module")
def rubbing():
    """Gas spring and seal friction, with only the law fitted."""
    return fit_baseline("gas_spring", "seal_friction")


def test_each_effect_of_a_set_is_left_out_once(rubbing):
    pool = rubbing.copy()
    pool.extend("gas_spring", "moving_mass")
    del pool.candidates[frozenset({"gas_spring"})]
    fit_subsets(pool)
    assert {frozenset({"gas_spring"}), frozenset({"moving_mass"})} <= set(pool.candidates)


def test_a_wrong_effect_is_exchanged_for_the_true_one():
    pool = fit_baseline("gas_spring", "moving_mass")
    pool.extend("end_stop", "moving_mass")
    exchange_effects(pool)
    assert pool.find_best().names == {"gas_spring", "moving_mass"}


def test_two_wrong_effects_are_exchanged_one_after_the_other(rubbing):
    pool = rubbing.copy()
    pool.extend("moving_mass", "side_load_friction")
    exchange_effects(pool)
    assert pool.find_best().names == {"gas_spring", "seal_friction"}


def test_nothing_is_exchanged_at_the_floor(rubbing):
    pool = rubbing.copy()
    pool.extend("gas_spring", "seal_friction")
    count = len(pool.fitted)
    exchange_effects(pool)
    assert len(pool.fitted) == count


def test_nothing_is_exchanged_after_the_budget_is_spent(rubbing):
    pool = rubbing.copy()
    pool.extend("moving_mass", "side_load_friction")
    spent = pool.copy(fit_budget=pool.fit_count)
    exchange_effects(spent)
    assert spent.fitted == []


@pytest.mark.parametrize(
    ("fitted", "true", "form"),
    [("clevis_backlash", "fixture_compliance", "linear"), ("fixture_compliance", "clevis_backlash", "free_pin")],
)
def test_backlash_and_compliance_are_tried_in_place_of_each_other(fitted, true, form):
    pool = fit_baseline("gas_spring", active(true, form))
    parent = pool.candidates[pool.extend("gas_spring")]
    fit_mounting(pool, parent, pool.screen(parent, parent.names), fitted)
    exchange_mounting(pool, frozenset({"gas_spring", fitted}))
    assert pool.find_best().names == {"gas_spring", true}
    assert pool.full_fits == {frozenset({"gas_spring", true})}


@pytest.mark.parametrize("names", [("gas_spring", "moving_mass"), ("clevis_backlash",)])
def test_a_set_without_another_effect_or_a_mounting_effect_stays_as_it_is(rubbing, names):
    pool = rubbing.copy()
    pool.extend(*names)
    count = len(pool.fitted)
    exchange_mounting(pool, frozenset(names))
    assert len(pool.fitted) == count
