import json

import jsonschema
import numpy as np
import pytest
from made_up_runs import NOISE, run, stiffening

from identification import schemas
from identification.errors import NothingToFit
from identification.gap.diagnose import diagnose, prepare
from identification.gap.documents import STAGES
from identification.gap.model import read_model
from sim_rig.scenario import parse_scenario


@pytest.fixture(scope="module")
def null():
    return diagnose([run()])


@pytest.fixture(scope="module")
def gas():
    return diagnose([run(stiffening)])


def test_the_law_alone_leaves_no_gap(null):
    found = null.diagnosis
    assert found.verdict == "no_gap"
    assert found.effects == []
    assert found.gap.shrinkage is None
    assert found.gap.before_n == pytest.approx(NOISE, rel=0.05)
    assert found.next_stroke is None
    assert "Nothing needs to be added" in found.explanation


def test_a_large_effect_is_named_though_its_form_differs(gas):
    found = gas.diagnosis
    assert found.verdict == "explained"
    assert [e.name for e in found.effects] == ["gas_spring"]
    assert found.effects[0].probability > 0.7
    assert found.effects[0].share > 0.9
    assert found.gap.shrinkage > 0.9
    low, high = found.gap.shrinkage_ci95
    assert low <= found.gap.shrinkage <= high
    assert found.where.stage == "damper"
    assert "gas" in found.explanation
    assert " N" in found.explanation


def test_every_run_has_another_zero_of_the_load_cell():
    shifted = run(lambda x, v: np.full(len(x), 8.0), seed=1)
    found = diagnose([run(), shifted]).diagnosis
    assert found.verdict == "no_gap"
    assert found.gap.before_n == pytest.approx(NOISE, rel=0.05)


def test_seen_and_unseen_strokes_agree(gas):
    gap = gas.diagnosis.gap
    assert gap.after_n == pytest.approx(gap.train_after_n, rel=0.1)
    assert gap.before_n == pytest.approx(gap.train_before_n, rel=0.3)


def test_every_parameter_has_an_interval_that_holds_it(gas):
    for effect in gas.diagnosis.effects:
        for value in effect.parameters.values():
            low, high = value.ci95
            assert low <= value.value <= high
            assert np.isfinite([low, high]).all()


def test_probabilities_add_to_one_at_most(gas, null):
    for found in (gas.diagnosis, null.diagnosis):
        total = found.probability + found.unknown_probability + sum(a.probability for a in found.alternatives)
        assert total <= 1.0 + 1e-9
        assert set(found.where.stages) == set(STAGES)


def test_the_document_is_of_its_schema(gas):
    schema = json.loads(schemas.schema_text("diagnosis"))
    jsonschema.validate(json.loads(gas.diagnosis.model_dump_json(by_alias=True)), schema)


def test_the_twin_is_a_scenario_of_the_rig_and_a_model_again(gas, tmp_path):
    text = gas.twin.model_dump_json(by_alias=True)
    scenario = parse_scenario(text, "twin")
    assert [e.name for e in scenario.effects] == ["gas_spring"]
    path = tmp_path / "twin.json"
    path.write_text(text, encoding="utf-8")
    model = read_model(path)
    assert model.baseline is not None
    assert [e.effect.name for e in model.effects] == ["gas_spring"]


def test_a_given_simulation_is_judged_too(gas, tmp_path):
    path = tmp_path / "twin.json"
    path.write_text(gas.twin.model_dump_json(by_alias=True), encoding="utf-8")
    again = diagnose([run(stiffening, seed=1)], read_model(path))
    assert again.diagnosis.gap.nominal_n == pytest.approx(NOISE, rel=0.1)


def test_the_twin_keeps_the_lags_beside_which_it_was_fitted(gas, tmp_path):
    lags = gas.twin.nuisances.force_delay.value, gas.twin.nuisances.drive_delay.value
    assert lags[0] != 0.0
    path = tmp_path / "twin.json"
    path.write_text(gas.twin.model_dump_json(by_alias=True), encoding="utf-8")
    model = read_model(path)
    assert model.delays == pytest.approx(lags)
    prepared = prepare([run(stiffening)])
    left = prepared.judge.left([model.force_on(p) for p in prepared.judge.fitted_pieces()])
    assert prepared.judge.rmse(left)[0] == pytest.approx(gas.diagnosis.gap.train_after_n, rel=1e-3)


def test_logs_of_two_dampers_are_refused():
    with pytest.raises(NothingToFit, match="different specimens"):
        diagnose([run(), run(specimen="LAB-002")])
