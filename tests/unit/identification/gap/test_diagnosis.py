"""A diagnosis from recordings to its documents."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from identification.damper.effects import STAGES
from identification.documents import Diagnosis
from identification.errors import UnusableDataError
from identification.fitting import HoldOut
from identification.fitting.damper_model import read_damper_model
from identification.gap.diagnosis import diagnose, prepare_recordings
from identification.gap.selection import Posterior, SearchSettings, compute_final_posterior
from sim_rig.scenario.scenario import parse_scenario
from tests.support.runs import NOISE, run, stiffening


@pytest.fixture(scope="module")
def null():
    return diagnose([run()])


@pytest.fixture(scope="module")
def gas():
    return diagnose([run(stiffening)])


def test_a_recording_of_the_law_alone_has_no_gap(null):
    diagnosis = null.diagnosis
    assert diagnosis.verdict == "no_gap"
    assert diagnosis.effects == []
    assert diagnosis.gap.shrinkage is None
    assert diagnosis.gap.before_n == pytest.approx(NOISE, rel=0.05)
    assert diagnosis.next_stroke is None
    assert "Nothing needs to be added" in diagnosis.explanation


def test_a_large_effect_in_another_form_is_named(gas):
    diagnosis = gas.diagnosis
    assert diagnosis.verdict == "explained"
    assert [e.name for e in diagnosis.effects] == ["gas_spring"]
    assert diagnosis.effects[0].probability > 0.7
    assert diagnosis.effects[0].share > 0.9
    assert diagnosis.gap.shrinkage > 0.9
    low, high = diagnosis.gap.shrinkage_ci95
    assert low <= diagnosis.gap.shrinkage <= high
    assert diagnosis.where.stage == "damper"
    assert "gas" in diagnosis.explanation
    assert " N" in diagnosis.explanation


def test_the_zero_of_the_load_cell_may_differ_from_run_to_run():
    shifted = run(lambda x, v: np.full(len(x), 8.0), seed=1)
    diagnosis = diagnose([run(), shifted]).diagnosis
    assert diagnosis.verdict == "no_gap"
    assert diagnosis.gap.before_n == pytest.approx(NOISE, rel=0.05)


def test_fitted_and_held_out_cycles_agree(gas):
    gap = gas.diagnosis.gap
    assert gap.after_n == pytest.approx(gap.train_after_n, rel=0.1)
    assert gap.before_n == pytest.approx(gap.train_before_n, rel=0.3)


def test_every_parameter_has_an_interval_that_contains_it(gas):
    for effect in gas.diagnosis.effects:
        for value in effect.parameters.values():
            low, high = value.ci95
            assert low <= value.value <= high
            assert np.isfinite([low, high]).all()


def test_probabilities_add_to_one_at_most(gas, null):
    for diagnosis in (gas.diagnosis, null.diagnosis):
        total = (
            diagnosis.probability
            + diagnosis.unknown_probability
            + sum(a.probability for a in diagnosis.alternatives)
        )
        assert total <= 1.0 + 1e-9
        assert set(diagnosis.where.stages) == set(STAGES)


def test_the_document_follows_its_schema(gas):
    schema = Diagnosis.model_json_schema(by_alias=True)
    jsonschema.validate(json.loads(gas.diagnosis.model_dump_json(by_alias=True)), schema)


def test_the_twin_is_a_scenario_of_the_rig_and_a_damper_model(gas, tmp_path):
    text = gas.twin.model_dump_json(by_alias=True)
    scenario = parse_scenario(text, "twin")
    assert [e.name for e in scenario.effects] == ["gas_spring"]
    path = tmp_path / "twin.json"
    path.write_text(text, encoding="utf-8")
    model = read_damper_model(path)
    assert model.baseline is not None
    assert [e.effect.name for e in model.effects] == ["gas_spring"]


def test_the_gap_of_a_given_simulation_is_reported(gas, tmp_path):
    path = tmp_path / "twin.json"
    path.write_text(gas.twin.model_dump_json(by_alias=True), encoding="utf-8")
    once = SearchSettings(fit_budget=1)  # what the search finds is not asked here
    result = diagnose([run(stiffening, seed=1)], read_damper_model(path), settings=once)
    assert result.diagnosis.gap.nominal_n == pytest.approx(NOISE, rel=0.1)


def test_the_twin_keeps_the_residual_delays_of_its_fit(gas, tmp_path):
    delays = gas.twin.nuisances.force_delay.value, gas.twin.nuisances.drive_delay.value
    assert delays[0] != 0.0
    path = tmp_path / "twin.json"
    path.write_text(gas.twin.model_dump_json(by_alias=True), encoding="utf-8")
    model = read_damper_model(path)
    assert model.delays == pytest.approx(delays)
    prepared = prepare_recordings([run(stiffening)])
    residual = prepared.evaluation.compute_residual(
        [model.simulate_force(p) for p in prepared.evaluation.select_fitted_pieces()]
    )
    assert prepared.evaluation.compute_rmse(residual)[0] == pytest.approx(
        gas.diagnosis.gap.train_after_n, rel=1e-3
    )


def test_logs_of_two_dampers_are_refused():
    with pytest.raises(UnusableDataError, match="different specimens"):
        diagnose([run(), run(specimen="LAB-002")])


def hold_out_and_spoil(pattern, gain):
    """A recording with a gas spring whose held-out force has a gain, diagnosed without that segment."""
    recording = run(stiffening)
    (stretch,) = recording.stretches
    held_out = HoldOut((pattern,)).make_mask(stretch)
    assert 0.05 < held_out.mean() < 0.5
    spoiled = replace(stretch, force=np.where(held_out, gain * stretch.force, stretch.force))
    return diagnose([replace(recording, stretches=(spoiled,))], hold_out=HoldOut((pattern,))).diagnosis


def test_held_out_strokes_are_read_by_no_choice():
    pattern = "10mm_*_0.[35]V"
    true, spoiled = (hold_out_and_spoil(pattern, gain).model_dump() for gain in (1.0, 1.5))
    good, bad = true["gap"].pop("held_out"), spoiled["gap"].pop("held_out")
    assert good["rmse_n"] < 1.3 * NOISE
    assert bad["rmse_n"] > 3.0 * good["rmse_n"]
    assert good["nrmse"] < 0.1
    assert true == spoiled
    assert true["provenance"]["settings"]["hold_out"] == pattern


def test_without_a_hold_out_there_is_no_error_of_held_out_strokes(gas):
    assert gas.diagnosis.gap.held_out is None
    assert gas.diagnosis.provenance.settings["hold_out"] is None


def test_a_part_of_the_cause_may_be_a_set_that_was_fitted_last(monkeypatch):
    # The probabilities of whole causes were computed before this set was fitted.
    def forget(pool):
        compute_final_posterior(pool)
        return Posterior({frozenset(): 0.01}, 0.99)

    monkeypatch.setattr("identification.gap.diagnosis.compute_final_posterior", forget)
    diagnosis = diagnose([run(stiffening)]).diagnosis
    assert diagnosis.verdict == "partly_explained"
    assert [e.name for e in diagnosis.effects] == ["gas_spring"]
    assert diagnosis.probability == 0.0
    assert 0.2 < diagnosis.effects[0].probability <= 0.5
    assert diagnosis.gap.explainable_n <= diagnosis.gap.after_n * 1.01
