import json

import pytest

from sim_rig.errors import ScenarioError
from sim_rig.scenario.scenario import parse_scenario
from tests.unit.sim_rig.definitions import define

FRICTION = define("parallel_force", "size*tanh(velocity/0.01)", ["velocity"], size=20.0)
DEFINITION = FRICTION["definition"]
BARE = {"name": "of_mine", "parameters": {"size": 20.0}}


@pytest.fixture
def folder(monkeypatch, tmp_path):
    monkeypatch.setenv("MRBENCH_EFFECTS", str(tmp_path))
    return tmp_path


def with_bounds(lo, hi):
    size = {"value": 20.0, "unit": "N kg/K", "lo": lo, "hi": hi}
    return {**FRICTION, "definition": {**DEFINITION, "parameters": {"size": size}}}


def test_a_definition_plays_without_an_effect_file(varied, folder):
    (active,) = varied(effects=[FRICTION]).effects
    assert active.effect.find_form(active.form).action == "force_function"


def test_an_effect_file_of_the_user_is_copied_into_the_scenario(varied, folder):
    file = folder / "of_mine.json"
    file.write_text(json.dumps(DEFINITION))
    text = varied(effects=[BARE]).model_dump_json(by_alias=True)
    file.unlink()
    (active,) = parse_scenario(text, "of a test").effects
    assert active.definition.expression == DEFINITION["expression"]


def test_a_given_definition_precedes_the_file_of_that_name(varied, folder):
    (folder / "of_mine.json").write_text(json.dumps({**DEFINITION, "expression": "size"}))
    (active,) = varied(effects=[FRICTION]).effects
    assert active.definition.expression == DEFINITION["expression"]


REFUSED = {
    "name of another": ({**FRICTION, "name": "of_yours"}, "effects: of_yours has a definition of of_mine"),
    "no such effect": ({**BARE, "name": "ghost"}, "no effect 'ghost'; there are .*of_mine"),
    "no such form": ({**FRICTION, "form": "linear"}, "of_mine has the form defined, not linear"),
    "no such parameter": ({**FRICTION, "parameters": {"width": 1.0}}, "of_mine takes size, not width"),
    "above its bounds": (
        with_bounds(5.0, 30.0) | {"parameters": {"size": 31.0}},
        "of_mine.size .* is 31 N kg/K, outside 5 to 30 N kg/K$",
    ),
    "below its bounds": (with_bounds(5.0, 30.0) | {"parameters": {"size": 4.0}}, "of_mine.size .* is 4 N kg/K"),
    "expression that is code": (
        {**FRICTION, "definition": {**DEFINITION, "expression": "size*open(velocity)"}},
        "effects.0.definition.*'open\\(velocity\\)'",
    ),
    "variable at another place": (
        {**FRICTION, "definition": {**DEFINITION, "variables": ["force", "velocity"]}},
        "effects.0.definition.*, not force",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_entry_that_cannot_be_played_is_refused_in_one_line(varied, folder, case):
    (folder / "of_mine.json").write_text(json.dumps(DEFINITION))
    entry, message = REFUSED[case]
    with pytest.raises(ScenarioError, match=message) as refusal:
        varied(effects=[entry])
    assert "\n" not in str(refusal.value)


def test_a_broken_effect_file_is_refused_with_its_path(varied, folder):
    (folder / "broken.json").write_text("{")
    with pytest.raises(ScenarioError, match=r"scenario of a test: effects: .*broken\.json: "):
        varied(effects=[BARE])


def test_a_value_may_have_a_unit_of_the_drive(varied):
    entry = with_bounds(0.0, 1.0) | {"parameters": {"size": 2.0}}
    size = {"value": 1.0, "unit": "N/{drive}", "lo": 0.0, "hi": 1.0}
    entry["definition"] = {**DEFINITION, "parameters": {"size": size}}
    with pytest.raises(ScenarioError, match=r"is 2 N/drive, outside 0 to 1 N/drive$"):
        varied(effects=[entry])


def test_a_defined_effect_is_no_alternative_effect(varied):
    with pytest.raises(ScenarioError, match="of_mine has a definition; list it among `effects`"):
        varied(alternative_effects=[FRICTION])


def test_a_defined_effect_listed_twice_is_refused(varied):
    with pytest.raises(ScenarioError, match="listed twice"):
        varied(effects=[FRICTION, FRICTION])
