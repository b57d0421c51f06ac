"""Truth file: complete, private, and never written over another file."""

import json
import stat

import pytest

from sim_rig.effect_forms import FORMS
from sim_rig.errors import TruthError
from sim_rig.hidden_effect import draw_scenario, make_truth, write_truth
from sim_rig.scenario import parse_scenario


@pytest.fixture
def scenario():
    return draw_scenario(3)


def test_the_truth_names_effect_stage_place_form_and_parameters_with_units(scenario):
    truth, (effect,) = make_truth(scenario), scenario.alternative_effects
    form = FORMS[effect.form]
    assert (truth.effect, truth.stage, truth.form, truth.seed) == (effect.name, form.stage, effect.form, 3)
    assert truth.place == form.place.name.lower()
    assert {name: parameter.value for name, parameter in truth.parameters.items()} == effect.parameters
    assert all("{" not in parameter.unit and parameter.unit for parameter in truth.parameters.values())


def test_its_scenario_is_the_one_that_was_played(scenario):
    assert parse_scenario(json.dumps(make_truth(scenario).scenario), "of a truth") == scenario


def test_only_its_owner_can_read_it(scenario, tmp_path):
    write_truth(tmp_path / "truth.json", make_truth(scenario))
    assert stat.S_IMODE((tmp_path / "truth.json").stat().st_mode) == 0o600
    assert [path.name for path in tmp_path.iterdir()] == ["truth.json"]


def test_an_earlier_truth_is_replaced(scenario, tmp_path):
    write_truth(tmp_path / "truth.json", make_truth(draw_scenario(4)))
    write_truth(tmp_path / "truth.json", make_truth(scenario))
    assert json.loads((tmp_path / "truth.json").read_text())["seed"] == 3


@pytest.mark.parametrize("content", ["notes of a person", '{"schema": "mrbench.fit/1"}', ""])
def test_another_file_is_not_replaced(scenario, tmp_path, content):
    (tmp_path / "truth.json").write_text(content)
    with pytest.raises(TruthError, match="not a truth file, so it is not replaced; choose another --truth"):
        write_truth(tmp_path / "truth.json", make_truth(scenario))
    assert (tmp_path / "truth.json").read_text() == content


def test_a_missing_folder_is_an_error(scenario, tmp_path):
    with pytest.raises(TruthError, match=r"cannot be written .*; choose another --truth"):
        write_truth(tmp_path / "nowhere" / "truth.json", make_truth(scenario))
