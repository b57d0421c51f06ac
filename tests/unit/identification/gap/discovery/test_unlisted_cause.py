"""Curves outside the library as evidence against named effects."""

import pytest

from identification.damper.effects import EFFECTS
from identification.gap.discovery import compare_with_curves
from identification.gap.discovery.curve_effects import CURVE_PLACES, CurvePlace
from identification.gap.discovery.unlisted_cause import (
    find_unlisted_cause,
    is_unlisted,
    list_pairs,
    locate_unlisted_cause,
)
from identification.gap.selection import Posterior
from tests.support.discoveries import GAIN, MOUNTING, SPRING, pool_with


@pytest.mark.parametrize(
    ("place", "variables", "unlisted"),
    [
        ("damper_gain", ("displacement",), True),
        ("damper_gain", ("velocity",), False),
        ("drive", ("time", "drive"), True),
        ("field", ("drive",), False),
        ("parallel_force", ("travel_since_reversal", "velocity"), False),
        ("parallel_force", ("travel_since_rest", "velocity"), True),
        ("force_channel", ("force",), True),
        ("force_channel", ("time",), False),
    ],
)
def test_a_curve_is_unlisted_where_no_effect_of_the_library_acts(place, variables, unlisted):
    assert is_unlisted(CurvePlace(place, variables), EFFECTS) is unlisted


def test_a_smaller_library_has_fewer_places():
    without = {name: e for name, e in EFFECTS.items() if name != "field_saturation"}
    assert list_pairs(EFFECTS) - list_pairs(without) == {("field", "drive")}
    assert {(at.place, at.variables[0]) for at in CURVE_PLACES} > list_pairs(without)


def test_a_gain_over_the_displacement_is_a_cause_outside_the_library():
    pool = pool_with(GAIN)
    found = find_unlisted_cause(pool)
    assert found is not None
    assert found.held_out_rmse < 0.2 * pool.baseline.held_out_rmse


def test_a_force_over_the_displacement_may_be_an_effect_of_the_library():
    assert find_unlisted_cause(pool_with(SPRING)) is None


def test_without_named_effects_nothing_is_compared():
    pool, posterior = pool_with(GAIN), Posterior({frozenset(): 0.4}, 0.6)
    assert compare_with_curves(pool, posterior) is posterior
    assert pool.unlisted is None


@pytest.mark.parametrize(("cause", "stage"), [(GAIN, "damper"), (MOUNTING, "mounting")])
def test_the_stage_of_an_unknown_cause_is_that_of_the_curve_that_resembles_it(cause, stage):
    pool = pool_with(cause)
    stages = locate_unlisted_cause(pool, pool.baseline)
    assert sum(stages.values()) == pytest.approx(1.0)
    assert stages[stage] > 0.9


def test_without_a_gap_every_stage_is_about_equally_probable():
    pool = pool_with()
    stages = locate_unlisted_cause(pool, pool.baseline)
    assert max(stages.values()) < 0.6
