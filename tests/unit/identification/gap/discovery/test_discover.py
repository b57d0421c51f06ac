"""Search for a cause outside the library: found at its place, or not at all."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import EffectModel
from identification.gap.discovery import curve_effects, curve_fit, discover
from identification.gap.discovery.curve_effects import CurvePlace
from identification.gap.discovery.discover import (
    _choose_finding,
    _find_further,
    _Finding,
    _is_accepted,
    discover_effect,
)
from tests.support.candidate_pools import BASELINE_FIT, NOISE
from tests.support.discoveries import GAIN, GROWING, MOUNTING, define, discovered_with, pool_with

ALTERNATING = define(
    "displacement_channel", "velocity*a*tanh(5*sin(time/s))", ("time", "velocity"), a=0.004, s=0.13
)
"""Delay of the displacement that changes its sign every 0.4 s."""
LATE = define("force_channel", "1-exp(-time/s)", ("force",), "step_response", s=0.01)
"""Lag of the force channel."""
OVER_DISPLACEMENT = CurvePlace("damper_gain", ("displacement",))
GROWING_OVER_DISPLACEMENT = CurvePlace("parallel_force", ("displacement", "drive"), grows_with_drive=True)


@pytest.fixture
def few_places(monkeypatch):
    """Try some places only, and fit one curve from the end of its linear model."""
    places = (OVER_DISPLACEMENT, GROWING_OVER_DISPLACEMENT, CurvePlace("mounting", ("acceleration",)))
    monkeypatch.setattr(curve_effects, "CURVE_PLACES", places)
    monkeypatch.setattr(curve_fit, "_FITTED_CURVES", 1)


def name_effect(pool, name):
    """Return the law with one effect of the library, fitted."""
    return pool.fit((EffectModel.from_name(name),), options=BASELINE_FIT)


def test_without_an_effect_nothing_is_found():
    assert discovered_with() is None


def test_a_gain_is_found_at_its_place_and_nothing_more():
    found = discovered_with(GAIN)
    assert found.fitted.curve.at == OVER_DISPLACEMENT
    assert found.formula.file.expression == "a*displacement**2+b*displacement**3"
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)
    assert found.further == ()


def test_a_disturbance_that_is_independent_of_the_motion_is_found_with_its_frequency():
    """71.3 Hz is beyond the mains frequencies that the library knows, and above half of the screening rate."""
    hum = define("force_channel", "a*sin(448*time)+b*sin(3*448*time)", ("time",), a=30.0, b=12.0)
    found = discovered_with(hum)
    assert (found.fitted.curve.at.place, found.fitted.curve.at.variables) == ("force_channel", ("time",))
    assert found.fitted.curve.at.period == pytest.approx(2.0 * np.pi / 448.0, rel=1e-4)
    assert found.formula.file.expression.count("sin") == 4
    values = {name: p.value for name, p in found.formula.file.parameters.items()}
    assert values["s"] == pytest.approx(1.0 / 448.0, rel=1e-5)
    assert np.hypot(values["a"], values["b"]) == pytest.approx(30.0, rel=0.05)
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)
    assert found.further == ()


def test_a_lag_of_the_force_channel_is_found_as_its_step_response():
    found = discovered_with(LATE)
    assert found.fitted.curve.at == CurvePlace("force_channel", ("force",), is_response=True)
    assert found.formula.file.kind == "step_response"
    (effect,) = found.candidate.fit.active_effects
    time = np.array([0.005, 0.01, 0.02, 0.05])
    response = effect.form.function({"time": time}, *effect.values)
    np.testing.assert_allclose(response, 1.0 - np.exp(-time / 0.01), atol=0.05)
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)


def test_a_delay_that_alternates_is_found_by_its_formula():
    found, pool = discovered_with(ALTERNATING), pool_with(ALTERNATING)
    assert found.fitted.curve.at == CurvePlace("displacement_channel", ("time", "velocity"), is_fine=True)
    assert found.formula.file.expression.startswith("velocity*(a*sin(time/s)")
    assert found.formula.file.parameters["s"].value == pytest.approx(0.13, rel=0.01)
    before, after = pool.baseline.held_out_rmse, found.candidate.held_out_rmse
    assert after**2 - NOISE**2 < 0.2 * (before**2 - NOISE**2)


def test_the_reported_set_is_fitted_on_all_samples():
    found, pool = discovered_with(GAIN), pool_with(GAIN)
    assert found.candidate.fit.problem.samples == pool.problems.full.samples
    assert found.formula.candidate.fit.problem.samples < pool.problems.full.samples
    assert found.candidate.names == {found.formula.file.name}


def test_a_search_leaves_the_candidates_of_the_pool_as_they_are():
    pool = pool_with(GAIN)
    assert discovered_with(GAIN) is not None
    assert list(pool.candidates) == [frozenset()]


def test_without_a_formula_the_curve_is_reported(monkeypatch, few_places):
    monkeypatch.setattr(discover, "find_formula", lambda pool, fitted: None)
    pool = pool_with(GAIN)
    found = discover_effect(pool, pool.baseline)
    assert found.formula is None
    assert found.candidate.names == {"curve"}
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)


def test_a_further_place_is_found_in_what_the_first_leaves(few_places):
    pool = pool_with(GROWING, MOUNTING)
    first = curve_fit.fit_best_curves(pool, pool.baseline, curve_fit.screen_curves(pool, pool.baseline))[0]
    assert first.curve.at == GROWING_OVER_DISPLACEMENT
    (further,) = _find_further(pool, first)
    assert further.curve.at == CurvePlace("mounting", ("acceleration",))
    assert further.parent is first.candidate
    assert first.candidate.held_out_rmse > 2.0 * NOISE
    assert further.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.06)


def test_named_effects_that_are_not_needed_are_left_out(few_places):
    pool = pool_with(GROWING).copy()
    named = name_effect(pool, "gas_spring")
    found = discover_effect(pool, named)
    assert found.candidate.names == {"discovered_effect"}
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)


def test_named_effects_that_are_needed_stay(few_places):
    pool = pool_with(GROWING, "moving_mass").copy()
    named = name_effect(pool, "moving_mass")
    found = discover_effect(pool, named)
    assert found.candidate.names == {"moving_mass", "discovered_effect"}
    assert found.candidate.held_out_rmse == pytest.approx(NOISE, rel=0.05)


@pytest.mark.parametrize(
    ("losses", "lengths", "chosen"),
    [
        ((1.0, 1.02), (3, 1), 1),  # equal but for chance: the shorter formula
        ((1.0, 1.02), (1, 3), 0),
        ((1.02, 1.0), (2, 2), 1),  # formulas of one length: the smaller error
        ((1.0, 1.06), (3, 1), 0),  # more than chance
        ((1.0, 1.02), (3, None), 0),  # a curve without a formula is longer than any
        ((1.0, 1.02), (None, None), 0),
    ],
)
def test_of_curves_that_do_equally_well_the_shortest_formula_is_chosen(monkeypatch, losses, lengths, chosen):
    curves = [SimpleNamespace(loss=loss, chance=0.05) for loss in losses]
    formulas = dict(zip(map(id, curves), lengths, strict=True))

    def describe(pool, fitted):
        count = formulas[id(fitted)]
        parameters = {f"p{k}": SimpleNamespace(lo=0.0, hi=1.0) for k in range(count or 0)}
        parameters["fixed"] = SimpleNamespace(lo=2.0, hi=2.0)
        file = SimpleNamespace(parameters=parameters)
        return _Finding(fitted, SimpleNamespace(file=file) if count else None, fitted)

    monkeypatch.setattr(discover, "_is_accepted", lambda pool, fitted: True)
    monkeypatch.setattr(discover, "_add_formula", describe)
    assert _choose_finding(None, curves).fitted is curves[chosen]


def make_fitted(*, before=4.0, after=2.0, log_odds=20.0, variables=("displacement",)):
    return SimpleNamespace(
        parent=SimpleNamespace(held_out_rmse=before, residual=None),
        candidate=SimpleNamespace(held_out_rmse=after, residual=None),
        curve=SimpleNamespace(at=CurvePlace("damper_gain", variables)),
        log_odds=log_odds,
    )


def make_pool(low=0.1, floor=2.0):
    evaluation = SimpleNamespace(estimate_shares=lambda *arguments: {"curve": (0.5, (low, 0.9))})
    return SimpleNamespace(floor=floor, evaluation=evaluation)


@pytest.mark.parametrize(
    ("fitted", "pool", "accepted"),
    [
        ({}, {}, True),
        ({"before": 1.9, "after": 1.0}, {}, False),  # no gap
        ({"log_odds": 2.9}, {}, False),
        ({"log_odds": 3.1}, {}, True),
        ({"log_odds": 3.1, "variables": ("displacement", "velocity")}, {}, False),
        ({"log_odds": 6.1, "variables": ("displacement", "velocity")}, {}, True),
        ({"after": np.sqrt(16.0 - 0.21 * 12.0)}, {}, True),
        ({"after": np.sqrt(16.0 - 0.19 * 12.0)}, {}, False),
        ({}, {"low": 0.0}, False),
        ({}, {"low": -0.1}, False),
    ],
)
def test_a_curve_is_accepted_if_it_closes_a_fifth_of_the_gap_beyond_chance(fitted, pool, accepted):
    assert _is_accepted(make_pool(**pool), make_fitted(**fitted)) == accepted
