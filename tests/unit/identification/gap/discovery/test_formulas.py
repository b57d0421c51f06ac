"""Formulas of a curve: each is found from its own values, up to what the law takes up."""

from typing import get_args

import numpy as np
import pytest

from identification.damper.definitions import Expression
from identification.damper.effects import Variable
from identification.gap.discovery import formulas
from identification.gap.discovery.formulas import FORMULAS, PERIODIC_FORMULAS, rank_formulas
from tests.support.discoveries import make_curve_stub

Z = np.sort(np.random.default_rng(1).uniform(-0.018, 0.02, 400))
SIZE = float(np.abs(Z).max())
MIDDLE, HALF = 0.5 * (Z.max() + Z.min()), 0.5 * (Z.max() - Z.min())
AMPLITUDES = (30.0, -12.0, 7.0, 5.0, -3.0, 2.0)
"""Size of each amplitude's term at the largest value of the variable."""
POSITIONS = {"m": MIDDLE + 0.4 * HALF, "l": MIDDLE - 0.4 * HALF}
SCALES = {"s": SIZE * formulas._SCALES[6], "r": SIZE * formulas._SCALES[9]}
WAVE = {"s": float(Z.max() - Z.min()) / (3.0 * np.pi)}
TWO_EXPONENTIALS = "a*exp(-abs(z)/s)+b*exp(-abs(z)/r)"


def choose_values(formula):
    """Return values of all parameters, on the grid of the search."""
    values = {
        name: a / SIZE**power for (name, power), a in zip(formula.amplitudes.items(), AMPLITUDES, strict=False)
    }
    known = {"size": {"s": SIZE}, "power": {"p": 1.5}, "position": POSITIONS, "scale": SCALES, "wave": WAVE}
    return values | {name: known[role][name] for name, role in formula.others.items()}


def evaluate(formula, values, z=Z):
    return Expression.parse(formula.text).evaluate({**values, "z": z})


def rank(function, place="damper_gain", variables=("displacement",), z=Z):
    return rank_formulas(make_curve_stub(place, variables, function), np.ones(1), z)


@pytest.mark.parametrize("formula", FORMULAS, ids=lambda f: f.text)
def test_a_formula_is_found_from_its_own_values(formula):
    truth = choose_values(formula)
    starts = rank(lambda z: evaluate(formula, truth, z))
    assert sorted(s.formula.text for s in starts) == sorted(f.text for f in FORMULAS)
    assert [s.error for s in starts] == sorted(s.error for s in starts)
    rank_of_it = next(i for i, s in enumerate(starts) if s.formula == formula)
    # Those before it are equal to it.
    assert all(s.error < 1e-9 for s in starts[: rank_of_it + 1])
    assert starts[-1].error > 0.05
    found = starts[rank_of_it].values
    if formula.text == TWO_EXPONENTIALS and found["s"] > found["r"]:
        found = {"a": found["b"], "b": found["a"], "s": found["r"], "r": found["s"]}
    assert found == pytest.approx(truth, rel=1e-5)


@pytest.mark.parametrize("formula", PERIODIC_FORMULAS, ids=lambda f: f.text)
def test_a_curve_that_repeats_has_the_formula_of_its_harmonics(formula):
    truth = choose_values(formula) | {"s": 0.02 / (2.0 * np.pi)}
    stub = make_curve_stub("force_channel", ("time",), lambda z: evaluate(formula, truth, z), period=0.02)
    starts = rank_formulas(stub, np.ones(1), np.linspace(0.0, 30.0, 4000))
    assert sorted(s.formula.text for s in starts) == sorted(f.text for f in PERIODIC_FORMULAS)
    found = next(s for s in starts if s.formula == formula)
    assert found.error < 1e-9
    assert found.values == pytest.approx(truth, rel=1e-5)


@pytest.mark.parametrize("cycles", [0.6, 1.3, 5.4, 13.7, 18.9])
def test_a_wave_over_time_is_found_near_its_period(cycles):
    truth = 85.0 / (2.0 * np.pi * cycles)
    time = np.linspace(2.0, 87.0, 2000)
    starts = rank(lambda z: np.tanh(4.0 * np.sin(z / truth + 1.0)), "drive", ("time", "drive"), time)
    waves = [s for s in starts if s.formula in PERIODIC_FORMULAS]
    assert len(waves) == len(PERIODIC_FORMULAS)
    assert min(s.error for s in waves) == starts[0].error < 0.2
    # From here, the fit reaches the period: the phase is off by less than a quarter of a cycle at both ends.
    nearest = starts[0].values["s"]
    assert abs(0.5 * 85.0 / nearest - 0.5 * 85.0 / truth) < 0.5 * np.pi


def test_only_a_curve_over_time_is_compared_with_higher_harmonics():
    over_time, over_position = (
        {s.formula.text for s in rank(np.sin, place, variables)}
        for place, variables in (("force_channel", ("time",)), ("damper_gain", ("displacement",)))
    )
    assert over_time - over_position == {f.text for f in PERIODIC_FORMULAS[1:]}


def test_a_formula_is_worse_on_the_values_of_another():
    errors = {s.formula.text: s.error for s in rank(lambda z: 5.0 * np.tanh(z / (0.1 * SIZE)))}
    assert errors["a*z"] > 0.1
    assert errors["a*z**2"] > 0.5
    assert errors["a*tanh(z/s)"] < 0.01


@pytest.mark.parametrize(
    ("place", "variables", "absorbed"),
    [
        ("damper_gain", ("displacement",), lambda z: 0.0 * z),
        ("field", ("drive",), lambda z: -4e3 * z),
        ("parallel_force", ("displacement",), lambda z: 9e3 * z),
        ("parallel_force", ("velocity",), lambda z: 9e3 * z + 60.0 * np.tanh(z / (0.05 * SIZE))),
        ("displacement_channel", ("displacement",), lambda z: 5e3 * z),
        ("displacement_channel", ("velocity",), lambda z: 5e3 * z),
        ("force_channel", ("force",), lambda z: 5e3 * z),
        ("force_channel", ("drive",), lambda z: 5e3 * z),
    ],
)
def test_what_the_law_takes_up_does_not_change_the_formula(place, variables, absorbed):
    found = next(
        s
        for s in rank(lambda z: 30.0 * (z / SIZE) ** 2 + 80.0 + absorbed(z), place, variables)
        if s.formula.text == "a*z**2"
    )
    assert found.error < 1e-9
    assert found.values["a"] == pytest.approx(30.0 / SIZE**2)


@pytest.mark.parametrize(
    ("place", "variables"),
    [
        ("damper_gain", ("displacement",)),
        ("parallel_force", ("displacement", "velocity")),
        ("mounting", ("acceleration",)),
        ("force_channel", ("time",)),
    ],
)
def test_a_straight_line_that_the_law_cannot_take_up_counts(place, variables):
    starts = rank(lambda z: 30.0 * (z / SIZE) ** 2 + 60.0 * z / SIZE, place, variables)
    quadratic = next(s for s in starts if s.formula.text == "a*z**2")
    assert quadratic.error > 0.5
    line = next(s for s in rank(lambda z: 50.0 * z, place, variables) if s.formula.text == "a*z")
    assert (line.values["a"], line.error) == pytest.approx((50.0, 0.0), abs=1e-9)


def test_frequent_values_count_more():
    def fit_quadratic(z):
        starts = rank(lambda z: np.where(z < 0.015, (z / SIZE) ** 2, 2.0), z=z)
        return next(s for s in starts if s.formula.text == "a*z**2").values["a"] * SIZE**2

    below, above = np.linspace(-0.018, 0.0149, 1000), np.linspace(0.015, 0.02, 200)
    assert fit_quadratic(np.concatenate([below, above[::200]])) == pytest.approx(1.0, rel=0.02)
    assert fit_quadratic(np.concatenate([below[::20], above])) > 1.5


@pytest.mark.parametrize("formula", [*FORMULAS, *PERIODIC_FORMULAS], ids=lambda f: f.text)
def test_a_formula_is_an_expression_of_any_variable(formula):
    truth = choose_values(formula)
    for variable in get_args(Variable):
        written = Expression.parse(formula.write(variable))
        assert written.names == {variable, *formula.amplitudes, *formula.others}
        np.testing.assert_array_equal(written.evaluate({**truth, variable: Z}), evaluate(formula, truth))


@pytest.mark.parametrize("formula", [*FORMULAS, *PERIODIC_FORMULAS], ids=lambda f: f.text)
def test_amplitudes_act_linearly_and_have_the_stated_power_of_the_unit(formula):
    truth = choose_values(formula)
    terms = [
        evaluate(formula, truth | dict.fromkeys(formula.amplitudes, 0.0) | {n: truth[n]})
        for n in formula.amplitudes
    ]
    np.testing.assert_allclose(np.sum(terms, axis=0), evaluate(formula, truth), rtol=1e-9, atol=1e-9)
    # The same curve over a variable in thousandths of its unit.
    smaller = {n: v / 1e3 ** formula.amplitudes.get(n, 0) for n, v in truth.items()}
    smaller |= {
        n: 1e3 * v for n, v in truth.items() if formula.others.get(n) in ("scale", "wave", "size", "position")
    }
    np.testing.assert_allclose(evaluate(formula, smaller, 1e3 * Z), evaluate(formula, truth), rtol=1e-9, atol=1e-9)


def test_a_curve_of_zero_has_formulas_of_zero():
    for start in rank(np.zeros_like):
        assert np.isfinite(list(start.values.values())).all()
        np.testing.assert_allclose(evaluate(start.formula, start.values), 0.0, atol=1e-9)
