"""Document of a discovered effect: its curve with a band, its formula, its definition, and another name."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.definitions import EffectFile, make_effect
from identification.documents import Fit, Provenance
from identification.fitting import EffectModel, read_damper_model
from identification.gap.data import Shrinkage
from identification.gap.diagnosis import prepare_recordings
from identification.gap.discovery import discover
from identification.gap.discovery.curve_effects import CurvePlace, make_fine_curve
from identification.gap.discovery.discover import discover_effect
from identification.gap.outcome.discovery_document import _make_curve, build_discovery, define_discovered_effect
from identification.gap.outcome.twin import make_twin
from tests.support.candidate_pools import NOISE, record
from tests.support.discoveries import (
    GAIN,
    GROWING,
    LENGTH,
    all_curves,
    discovered_with,
    fitted_with,
    make_problem,
    make_stroke,
    pool_with,
)
from tests.support.discovery_documents import make_discovery, make_result
from tests.support.result_documents import fit_document

SHRINKAGE = Shrinkage(36.0, 2.0, 0.97, (0.95, 0.99))
PROVENANCE = Provenance(logs={"short.mcap": "0" * 64}, version="0", seed=1, settings={})
FIT = Fit.model_validate(fit_document())
NOTHING = SimpleNamespace(names=frozenset())


@pytest.fixture(scope="module")
def with_formula():
    return discovered_with(GAIN)


@pytest.fixture(scope="module")
def with_curve():
    """Return the curve of a force that grows with the drive, as if no formula did as well."""
    pool = pool_with(GROWING)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(discover, "find_formula", lambda pool, fitted: None)
        patch.setattr(discover, "_find_curves", lambda pool, parent: [fitted_with(GROWING)])
        return replace(discover_effect(pool, pool.baseline), further=(fitted_with(GAIN),))


def simulate_definition(found, pool, definition):
    """Return the force of the chosen law with a definition, and that of the chosen set."""
    fit = found.candidate.fit
    problem = pool.problems.full.replace_effects(fit.effects)
    columns = list(problem.iterate_effects())[-1][1]
    model = EffectModel(
        make_effect(EffectFile.model_validate_json(definition.model_dump_json(by_alias=True))), "defined"
    )
    assert len(fit.effects) == 1
    other = pool.problems.full.replace_effects((model,))
    law = np.delete(fit.minimum.unknowns, columns)
    values = model.to_search(tuple(p.value for p in definition.parameters.values()))
    unknowns = np.insert(law, columns.start, values)
    return np.concatenate(other.simulate(unknowns)), np.concatenate(problem.simulate(fit.minimum.unknowns))


def test_the_definition_of_a_formula_gives_the_force_of_the_fitted_set(with_formula):
    definition = define_discovered_effect(with_formula)
    assert definition.curve is None
    found, expected = simulate_definition(with_formula, pool_with(GAIN), definition)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert np.std(expected) > 100.0


def test_the_definition_of_a_curve_gives_the_force_of_the_fitted_set(with_curve):
    definition = define_discovered_effect(with_curve)
    assert (definition.expression, list(definition.parameters)) == ("(1+growth*drive)*(curve)", ["growth"])
    found, expected = simulate_definition(with_curve, pool_with(GROWING), definition)
    # The file has a fifth of the points of the fitted table.
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.05 * NOISE


def test_the_band_of_a_curve_contains_the_truth(with_curve):
    curve = build_discovery(with_curve, NOTHING, SHRINKAGE, "V").curve
    x, value, low, high = (np.array(v) for v in (curve.x, curve.value, curve.lo, curve.hi))
    true = 30.0 * (x / LENGTH) ** 2
    assert (low <= value).all()
    assert (value <= high).all()
    # The law takes up a constant force; the curve is compared without one.
    shift = np.mean(value - true)
    assert abs(shift) < 1.0
    assert np.mean((low <= true + shift) & (true + shift <= high)) > 0.9
    assert (high - low).max() < 3.0
    assert (high - low).min() > 0.05
    assert (curve.variable, curve.unit, len(x)) == ("displacement", "N", 81)
    assert x[[0, -1]] == pytest.approx([-LENGTH, LENGTH], rel=0.01)


def test_a_document_has_place_errors_and_further_places(with_curve):
    document = build_discovery(with_curve, NOTHING, SHRINKAGE, "V")
    assert (document.stage, document.place, document.variables) == (
        "damper",
        "parallel_force",
        ["displacement", "drive"],
    )
    assert document.rmse_n == with_curve.candidate.held_out_rmse
    assert document.log_odds == with_curve.fitted.log_odds
    assert (document.shrinkage, document.shrinkage_ci95) == (0.97, (0.95, 0.99))
    assert document.formula is None
    assert document.definition.name == "discovered_effect"
    (further,) = document.further
    assert (further.place, further.rmse_n) == ("damper_gain", fitted_with(GAIN).candidate.held_out_rmse)


def test_a_formula_has_its_symbols_with_units_and_intervals(with_formula):
    formula = build_discovery(with_formula, NOTHING, SHRINKAGE, "V").formula
    assert formula.expression == "a*displacement**2+b*displacement**3"
    assert {name: s.unit for name, s in formula.symbols.items()} == {"a": "1/m^2", "b": "1/m^3"}
    for name, true in {"a": 0.4 / LENGTH**2, "b": 0.3 / LENGTH**3}.items():
        symbol = formula.symbols[name]
        low, high = symbol.ci95
        assert low < symbol.value < high
        assert symbol.value == pytest.approx(true, rel=0.02)
        assert high - low < 0.1 * true
    definition = build_discovery(with_formula, NOTHING, SHRINKAGE, "V").definition
    assert {n: p.value for n, p in definition.parameters.items()} == {
        n: s.value for n, s in formula.symbols.items()
    }


def test_named_effects_that_are_not_needed_are_replaced(with_formula):
    named = SimpleNamespace(names=frozenset({"gas_spring", "end_stop"}))
    assert build_discovery(with_formula, named, SHRINKAGE, "V").replaces == ["end_stop", "gas_spring"]
    both = SimpleNamespace(names=frozenset({"gas_spring", "discovered_effect"}))
    assert build_discovery(with_formula, both, SHRINKAGE, "V").replaces == ["gas_spring"]


def fit_flat(curve):
    """Return a fitted curve with coefficients of the same size."""
    count = curve.function.basis.size
    return SimpleNamespace(curve=curve, values=(0.1,) * count, covariance=np.eye(count))


@pytest.mark.parametrize("unit", ["A", "V"])
def test_a_document_is_about_one_drive_and_a_definition_about_any(unit):
    shift, relative = (
        fit_flat(all_curves()[CurvePlace(place, variables)])
        for place, variables in (("field", ("drive",)), ("drive", ("time", "drive")))
    )
    assert _make_curve(shift, unit).unit == unit
    assert _make_curve(shift, "").unit == "{drive}"
    assert _make_curve(relative, unit).unit == "1"


def test_a_curve_with_many_splines_has_more_points():
    at = CurvePlace("displacement_channel", ("time", "velocity"))
    fine = fit_flat(make_fine_curve(make_problem(make_stroke()), at))
    drawn = _make_curve(fine, "V")
    assert len(drawn.x) == len(drawn.value) == 4 * len(fine.values) + 1
    assert np.all(np.diff(drawn.x) > 0.0)


def test_the_band_has_the_deviation_of_the_curve():
    curve = all_curves()[CurvePlace("parallel_force", ("displacement", "drive"), grows_with_drive=True)]
    count = curve.function.basis.size
    root = np.random.default_rng(1).standard_normal((count + 1, count + 1))
    values = np.random.default_rng(2).standard_normal(count + 1)
    fitted = SimpleNamespace(curve=curve, values=tuple(values), covariance=root @ root.T)
    drawn = _make_curve(fitted, "V")
    x = {"displacement": np.array(drawn.x)}
    np.testing.assert_allclose(drawn.value, curve.function.evaluate(x, values[:count]), rtol=1e-9, atol=1e-9)
    # Each column of the root is an independent deviation of all coefficients.
    parts = [curve.function.evaluate(x, root[:count, k]) for k in range(count + 1)]
    deviation = np.sqrt(np.sum(np.square(parts), axis=0))
    np.testing.assert_allclose(np.array(drawn.hi) - drawn.value, 1.96 * deviation, rtol=1e-9)
    np.testing.assert_allclose(np.array(drawn.value) - drawn.lo, 1.96 * deviation, rtol=1e-9)


def test_the_twin_has_the_definition_with_the_law_of_its_fit(with_formula, tmp_path):
    definition = define_discovered_effect(with_formula)
    dataset = prepare_recordings([record(GAIN)]).dataset
    twin = make_twin(dataset, with_formula.candidate, definition, FIT, 2.0, "LAB", PROVENANCE)
    (effect,) = twin.effects
    assert (effect.name, effect.form, effect.definition) == ("discovered_effect", "defined", definition)
    assert effect.parameters == {name: p.value for name, p in definition.parameters.items()}
    assert twin.description == "twin of LAB: the law with discovered_effect"
    path = tmp_path / "twin.json"
    path.write_text(twin.model_dump_json(by_alias=True), encoding="utf-8")
    model = read_damper_model(path)
    pieces = pool_with(GAIN).problems.full.pieces
    errors = np.concatenate([model.simulate_force(p) - p.force for p in pieces])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(NOISE, rel=0.05)


def test_a_twin_of_named_effects_has_no_definition():
    pool = pool_with(GAIN)
    dataset = prepare_recordings([record(GAIN)]).dataset
    assert make_twin(dataset, pool.baseline, None, FIT, 2.0, "", PROVENANCE).effects == []


def test_a_result_has_the_new_name_everywhere():
    result = make_result(make_discovery())
    renamed = result.rename_discovery("my_gain")
    assert renamed.diagnosis.discovery.definition.name == "my_gain"
    last = renamed.twin.effects[-1]
    assert (last.name, last.definition.name) == ("my_gain", "my_gain")
    assert renamed.twin.effects[0] == result.twin.effects[0]
    assert renamed.diagnosis.discovery.definition == last.definition
    assert renamed.diagnosis.notes == result.diagnosis.notes
    # The first result is as it was.
    assert result.diagnosis.discovery.definition.name == result.twin.effects[-1].name == "discovered_effect"


def test_without_a_discovery_nothing_is_renamed():
    result = make_result()
    assert result.rename_discovery("my_gain") is result
