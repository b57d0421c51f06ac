"""Formulas in the place of a curve: the choice of one, its units, and its definition as an effect file."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.definitions import Curve, EffectParameter, make_effect
from identification.gap.discovery import formula_fit, formulas
from identification.gap.discovery.curve_effects import CURVE_PLACES
from identification.gap.discovery.formula_fit import (
    DISCOVERED,
    _divide_unit,
    _keeps_gain,
    _make_file,
    find_formula,
    make_curve_file,
    update_values,
)
from identification.gap.discovery.formulas import FORMULAS, FormulaStart, rank_formulas
from tests.support.discoveries import (
    GAIN,
    GROWING,
    LENGTH,
    all_curves,
    collect_all_variables,
    find_curve,
    fitted_with,
    make_stroke,
    pool_with,
)


def find_start(text, **values):
    return FormulaStart(next(f for f in FORMULAS if f.text == text), values, 0.0)


def make_fitted(curve, *values):
    return SimpleNamespace(curve=curve, values=values)


def test_the_formula_of_a_gain_is_found_with_its_values():
    found = find_formula(pool_with(GAIN), fitted_with(GAIN))
    assert found.file.expression == "a*displacement**2+b*displacement**3"
    values = {name: p.value for name, p in found.file.parameters.items()}
    assert values == pytest.approx({"a": 0.4 / LENGTH**2, "b": 0.3 / LENGTH**3}, rel=0.02)
    assert [p.unit for p in found.file.parameters.values()] == ["1/m^2", "1/m^3"]
    assert (found.file.name, found.file.place, found.file.stage) == (DISCOVERED, "damper_gain", "damper")
    assert found.candidate.held_out_rmse < 1.05 * pool_with(GAIN).floor
    assert found.candidate.fit.active_effects[-1].values == pytest.approx(tuple(values.values()))


def test_the_formula_of_a_force_that_grows_with_the_drive_has_the_growth():
    found = find_formula(pool_with(GROWING), fitted_with(GROWING))
    assert found.file.expression == "(1+growth*drive)*(a*displacement**2)"
    assert {n: p.value for n, p in found.file.parameters.items()} == pytest.approx(
        {"a": 30.0 / LENGTH**2, "growth": 6.0}, rel=0.03
    )
    assert {n: p.unit for n, p in found.file.parameters.items()} == {"a": "N/m^2", "growth": "1/{drive}"}


def test_without_a_sufficient_formula_there_is_none(monkeypatch):
    monkeypatch.setattr(formulas, "FORMULAS", (FORMULAS[0],))
    assert FORMULAS[0].text == "a*z"
    assert find_formula(pool_with(GAIN), fitted_with(GAIN)) is None


def test_of_two_formulas_that_do_as_well_the_shorter_is_chosen(monkeypatch):
    shorter, longer = (
        next(f for f in FORMULAS if f.text == text) for text in ("a*z**2+b*z**3", "a*z**2+b*z**3+c*z**4")
    )
    for order in ((shorter, longer), (longer, shorter)):
        starts = [s for f in order for s in rank_of(fitted_with(GAIN)) if s.formula == f]
        monkeypatch.setattr(formula_fit, "rank_formulas", lambda *arguments, starts=starts: starts)
        assert list(find_formula(pool_with(GAIN), fitted_with(GAIN)).file.parameters) == ["a", "b"]


def rank_of(fitted):
    x = np.linspace(-LENGTH, LENGTH, 500)
    return rank_formulas(fitted.curve, np.array(fitted.values[: fitted.curve.function.basis.size]), x)


@pytest.mark.parametrize("error", [2.0, 5.19, 5.21, 12.0])
@pytest.mark.parametrize(("other", "sufficient"), [(2.0, True), (5.21, False)])
def test_a_formula_keeps_four_fifths_of_the_gain_of_its_curve_on_fitted_and_held_out_strokes(
    error, other, sufficient
):
    # The squared error falls from 123 to 3, so a formula may leave 27.
    before, after = (SimpleNamespace(train_rmse=e, held_out_rmse=e) for e in np.sqrt([123.0, 3.0]))
    fitted = SimpleNamespace(parent=before, candidate=after)
    for errors in ((error, other), (other, error)):
        formula = SimpleNamespace(train_rmse=errors[0], held_out_rmse=errors[1])
        assert _keeps_gain(fitted, formula) == (sufficient and error < 5.2)


@pytest.mark.parametrize(
    ("unit", "divisor", "power", "result"),
    [
        ("N", "m", 0, "N"),
        ("N", "m", 1, "N/m"),
        ("N", "m", 2, "N/m^2"),
        ("N", "m/s", 1, "N/(m/s)"),
        ("N", "m/s^2", 3, "N/(m/s^2)^3"),
        ("1", "{drive}", 2, "1/{drive}^2"),
        ("N", "N", 1, "1"),
        ("N", "N", 3, "1/N^2"),
    ],
)
def test_the_unit_of_an_amplitude_is_divided_by_a_power_of_the_variables_unit(unit, divisor, power, result):
    assert _divide_unit(unit, divisor, power) == result


@pytest.mark.parametrize(
    ("place", "variables", "unit", "variable_unit"),
    [
        ("damper_gain", ("dissipated_energy",), "1/J", "J"),
        ("parallel_force", ("velocity",), "N/(m/s)", "m/s"),
        ("parallel_force", ("travel_since_rest", "velocity"), "N/m", "m"),
        ("field", ("drive_history",), "1", "{drive}"),
        ("drive", ("time", "drive"), "1/s", "s"),
        ("mounting", ("acceleration",), "N/(m/s^2)", "m/s^2"),
        ("displacement_channel", ("velocity",), "m/(m/s)", "m/s"),
        ("force_channel", ("force",), "1", "N"),
    ],
)
def test_parameters_have_units_of_place_and_variable(place, variables, unit, variable_unit):
    curve = find_curve(place, *variables)
    line = _make_file(make_fitted(curve), find_start("a*z", a=2.0), np.linspace(0.0, 4.0, 9))
    assert line.parameters["a"].unit == unit
    start = find_start("a*tanh((z-m)/s)", a=2.0, m=1.0, s=0.5)
    parameters = _make_file(make_fitted(curve), start, np.linspace(0.0, 4.0, 9)).parameters
    assert (parameters["m"].unit, parameters["s"].unit) == (variable_unit, variable_unit)
    assert (parameters["m"].lo, parameters["m"].hi) == (0.0, 4.0)
    assert (parameters["s"].lo, parameters["s"].hi) == pytest.approx((4e-4, 400.0))
    assert parameters["a"].hi == -parameters["a"].lo == 100.0 * max(2.0, curve.function.scale)


def test_a_size_is_kept_and_a_power_is_limited():
    start = find_start("a*abs(z/s)**p", a=2.0, s=4.0, p=1.5)
    parameters = _make_file(
        make_fitted(find_curve("mounting", "acceleration")), start, np.array([-4.0, 3.0])
    ).parameters
    assert (parameters["s"].lo, parameters["s"].value, parameters["s"].hi) == (4.0, 4.0, 4.0)
    assert (parameters["p"].lo, parameters["p"].value, parameters["p"].hi, parameters["p"].unit) == (
        0.1,
        1.5,
        6.0,
        "1",
    )


@pytest.mark.parametrize("at", CURVE_PLACES, ids=lambda at: at.label)
def test_the_file_of_a_curve_has_the_values_of_its_function(at):
    curve = all_curves()[at]
    function, stroke = curve.function, make_stroke()
    random = np.random.default_rng(5)
    values = (*random.standard_normal(function.basis.size), *((0.7,) if at.grows_with_drive else ()))
    table = function.scale * np.array(values[: function.basis.size]) @ np.array(function.basis.table)
    x, y = list(function.basis.positions), table.tolist()
    if at.is_response:
        x, y = [*x, x[-1] * (1.0 + 1e-9)], [*(1.0 - table), 1.0]
    drawn = Curve(variable=at.argument, unit="1", x=x, value=y)
    file = make_curve_file(make_fitted(curve, *values), "curve", {}, drawn)
    assert (file.place, file.stage, file.variables) == (at.place, curve.model.effect.stage, list(at.variables))
    variables = collect_all_variables(stroke)
    found = make_effect(file).forms[0].function(variables, *(p.value for p in file.parameters.values()))
    np.testing.assert_allclose(found, function(variables, *values), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("growth", "kept"), [(0.5, 0.5), (1e3, 60.0), (-1e3, -1.9)])
def test_growth_beyond_its_limits_is_kept_at_them(growth, kept):
    curve = find_curve("parallel_force", "velocity", "drive")
    values = (*np.zeros(curve.function.basis.size), growth)
    parameters = {"a": EffectParameter(value=1.0, unit="N", lo=-2.0, hi=2.0)}
    file = make_curve_file(make_fitted(curve, *values), "a*velocity", parameters)
    assert file.parameters["growth"].value == pytest.approx(kept)
    assert list(file.parameters) == ["a", "growth"]


def test_values_are_replaced_in_the_order_of_the_parameters():
    file = _make_file(
        make_fitted(find_curve("damper_gain", "velocity")), find_start("a*tanh(z/s)", a=2.0, s=0.5), np.ones(3)
    )
    again = update_values(file, (3.0, 0.25))
    assert {name: p.value for name, p in again.parameters.items()} == {"a": 3.0, "s": 0.25}
    assert {name: (p.lo, p.hi, p.unit) for name, p in again.parameters.items()} == {
        name: (p.lo, p.hi, p.unit) for name, p in file.parameters.items()
    }
    with pytest.raises(ValueError, match="shorter"):
        update_values(file, (3.0,))
