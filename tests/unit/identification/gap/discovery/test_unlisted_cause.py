"""Curves outside the library as evidence against named effects."""

import pytest

from identification.damper.effects import EFFECTS
from identification.gap.discovery import compare_with_curves
from identification.gap.discovery.curve_effects import CURVE_PLACES, CurvePlace
from identification.gap.discovery.unlisted_cause import (
    find_best_curve,
    is_unlisted,
    list_causes,
    locate_unlisted_cause,
)
from identification.gap.selection import Posterior
from tests.support.discoveries import GAIN, MOUNTING, WAVE, pool_with
from tests.support.effects import active


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
        ("mounting", ("force",), False),
        ("mounting", ("displacement",), True),
        ("force_channel", ("time",), False),
    ],
)
def test_a_curve_is_unlisted_where_no_effect_of_the_library_acts(place, variables, unlisted):
    assert is_unlisted(CurvePlace(place, variables), EFFECTS) is unlisted


def test_a_smaller_library_has_fewer_places():
    without = {name: e for name, e in EFFECTS.items() if name != "field_saturation"}
    assert list_causes(EFFECTS) - list_causes(without) == {("field", "drive", False)}
    assert {(at.place, at.variables[0], at.is_response) for at in CURVE_PLACES} > list_causes(without)


def test_delays_and_lags_of_the_force_channel_are_step_responses():
    response = CurvePlace("force_channel", ("force",), is_response=True)
    assert not is_unlisted(response, EFFECTS)
    assert not is_unlisted(response, {"force_delay": EFFECTS["force_delay"]})
    assert not is_unlisted(response, {"force_filter": EFFECTS["force_filter"]})
    others = {name: e for name, e in EFFECTS.items() if name not in ("force_delay", "force_filter")}
    assert is_unlisted(response, others)


def compare(cause, *names):
    """A pool with a set of effects that is the most probable one, and its posterior after the comparison."""
    pool = pool_with(cause).copy()
    pool.extend(*names[:1])
    if names[1:]:
        pool.extend(*names)
    return pool, compare_with_curves(pool, Posterior({frozenset(names): 0.9}, 0.1))


def test_a_gain_over_the_displacement_is_a_cause_outside_the_library():
    pool = pool_with(GAIN)
    found = find_best_curve(pool)
    assert is_unlisted(found.curve.at, EFFECTS)
    assert found.candidate.held_out_rmse < 0.2 * pool.baseline.held_out_rmse


def test_a_cause_outside_the_library_is_more_probable_than_effects_that_leave_more():
    pool, posterior = compare(GAIN, "gas_spring", "end_stop")
    assert pool.curve.names == {"curve"}
    assert posterior.unknown > 0.9


def test_a_curve_at_the_place_of_an_effect_is_that_effect_in_another_form():
    pool, posterior = compare(WAVE, "gas_spring", "displacement_nonlinearity")
    assert pool.curve.names == {"gas_spring"}
    assert posterior.most_probable_set == {"gas_spring"}
    assert posterior.most_probable_set in pool.full_fits
    assert posterior.unknown < 0.2


def test_a_curve_at_the_place_of_an_effect_counts_only_if_it_reaches_the_floor(monkeypatch):
    pool = pool_with(WAVE).copy()
    posterior = Posterior({pool.extend("gas_spring"): 0.9}, 0.1)
    monkeypatch.setattr(pool, "reaches_floor", lambda candidate: False)
    assert compare_with_curves(pool, posterior) is posterior
    assert pool.curve is None


def test_a_set_at_the_floor_is_not_compared():
    pool = pool_with(active("end_stop")).copy()
    posterior = Posterior({pool.extend("end_stop"): 0.9}, 0.1)
    assert compare_with_curves(pool, posterior) is posterior
    assert pool.curve is None


@pytest.mark.parametrize(("cause", "names"), [(GAIN, {"curve"}), (WAVE, None)])
def test_a_curve_outside_the_library_is_compared_in_noise_where_the_floor_may_be_reached(
    monkeypatch, cause, names
):
    pool = pool_with(cause).copy()
    posterior = Posterior({pool.extend("gas_spring"): 0.9}, 0.1)
    monkeypatch.setattr(pool, "reaches_floor", lambda candidate: True)
    found = compare_with_curves(pool, posterior)
    if names is None:
        assert found is posterior
        assert pool.curve is None
    else:
        assert pool.curve.names == names
        evidence = pool.comparison.compute_noise_evidence(
            pool.candidates[frozenset({"gas_spring"})], pool.curve.candidate
        )
        assert 0.0 < evidence - pool.curve.evidence.log_odds < 100.0
        assert found.unknown > 0.9


def test_a_curve_that_only_fits_noise_is_no_alternative(monkeypatch):
    pool = pool_with(active("end_stop")).copy()
    posterior = Posterior({pool.extend("end_stop"): 0.9}, 0.1)
    monkeypatch.setattr(type(pool), "has_uncertain_floor", True)
    assert compare_with_curves(pool, posterior) is posterior
    assert pool.curve is None


def test_without_named_effects_nothing_is_compared():
    pool, posterior = pool_with(GAIN), Posterior({frozenset(): 0.4}, 0.6)
    assert compare_with_curves(pool, posterior) is posterior
    assert pool.curve is None


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
