import json

import pytest

from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from sim_rig.errors import ScenarioError
from sim_rig.scenario.scenario import list_shipped_scenarios, load_scenario, parse_scenario
from tests.support.effects import MEDIUM

LABORATORY = PARAMETER_SETS["laboratory"].parameters._asdict()
BACKLASH = {"name": "clevis_backlash", "parameters": {"gap": 1e-4}}


@pytest.mark.parametrize("name", list_shipped_scenarios())
def test_every_shipped_scenario_loads_and_has_a_description(name):
    assert load_scenario(name).description


def test_default_ideal_and_every_effect_are_shipped():
    assert {"default", "ideal", "noisy", "lord_class", *EFFECTS} <= set(list_shipped_scenarios())


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_scenario_is_the_default_rig_with_only_that_effect(name):
    scenario = load_scenario(name)
    assert [effect.name for effect in scenario.effects] == [name]
    assert scenario.sensors == load_scenario("default").sensors


def test_a_path_is_read_if_no_shipped_name_matches(tmp_path):
    file = tmp_path / "mine.json"
    file.write_text('{"schema": "mrbench.scenario/1", "seed": 7}')
    assert load_scenario(file).seed == 7


def test_the_fourteen_parameters_may_replace_a_name(varied):
    assert varied(damper=LABORATORY).parameters == varied().parameters


def test_a_twin_contains_its_baseline_and_provenance(varied):
    twin = varied(baseline={"rmse_n": 3.0}, provenance={"logs": ["ab12"]})
    assert twin.baseline == {"rmse_n": 3.0}
    assert twin.provenance == {"logs": ["ab12"]}


def test_a_named_sensor_replaces_the_default_one_completely(varied):
    force = varied("default", sensors={"force": {"noise": 1.0}}).sensors.force
    assert (force.noise, force.filter, force.resolution) == (1.0, None, 0.0)


def make_medium(name, form):
    """An effect of a scenario in one of its forms, at its medium size."""
    symbols = [q.symbol for q in EFFECTS[name].find_form(form).parameters]
    return {"name": name, "form": form, "parameters": dict(zip(symbols, MEDIUM[name][form], strict=True))}


REFUSED = {
    "unknown set": ({"damper": "racing"}, "no parameter set 'racing'; there are laboratory"),
    "parameter out of bounds": ({"damper": {**LABORATORY, "n": 9.0}}, r"n \(.*\) is 9, outside 1 to 6$"),
    "law out of bounds": ({"damper": {**LABORATORY, "c0_a": -5.0}}, r"c0_a \(.*\) is -5 N s/m, outside"),
    "no loop": ({"damper": {**LABORATORY, "beta": 0.0, "gamma": 0.0}}, "beta \\+ gamma is 0"),
    "missing parameter": ({"damper": {"n": 2.0}}, "alpha_a: is missing"),
    "unknown effect": ({"effects": [{"name": "ghost", "parameters": {}}]}, "no effect 'ghost'; there are"),
    "unknown form": (
        {"effects": [{**BACKLASH, "form": "cubic"}]},
        "has the form backlash, free_pin, greased_pin, not cubic",
    ),
    "unknown value": ({"effects": [{**BACKLASH, "parameters": {"width": 1.0}}]}, "takes gap, not width"),
    "effect out of bounds": (
        {"effects": [{**BACKLASH, "parameters": {"gap": 0.2}}]},
        r"clevis_backlash.gap \(.*\) is 0.2 m, outside 0 to 0.133333 m$",
    ),
    "effect twice": ({"effects": [BACKLASH, BACKLASH]}, "listed twice"),
    "two deflections": (
        {"effects": [make_medium("seal_friction", "presliding"), make_medium("side_load_friction", "bristle")]},
        "seal_friction, side_load_friction have a friction with deflection each, at most one may",
    ),
    "units at odds": ({"drive_unit": "A"}, "drive_unit is A, but coil_v is in V"),
    "damper of another unit": ({"damper": "lord_class"}, "lord_class is driven in A, but drive_unit is V"),
    "unknown field": ({"colour": "red"}, "colour: there is no such key"),
    "unknown channel": (
        {"faults": [{"kind": "stuck", "channel": "smell", "start": 0, "duration": 1}]},
        "faults.0.channel",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_unknown_or_out_of_bounds_entries_are_refused_in_one_line(varied, case):
    changes, message = REFUSED[case]
    with pytest.raises(ScenarioError, match=message) as refusal:
        varied(**changes)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "mrbench.scenario/9"}', json.dumps({"seed": 1})])
def test_a_text_that_is_not_a_scenario_is_refused_with_its_name(text):
    with pytest.raises(ScenarioError, match="scenario of a test: "):
        parse_scenario(text, "of a test")


def test_an_unknown_scenario_is_refused_with_the_shipped_names():
    with pytest.raises(ScenarioError, match="neither a file nor one of clevis_backlash, coil_crosstalk"):
        load_scenario("nowhere")


def test_a_parameter_set_that_is_not_a_damper_loads_with_its_warning(varied):
    with pytest.warns(UserWarning, match="not a damper"):
        varied(damper="paper_table_1")


def test_former_names_of_fields_and_fault_kinds_are_read(varied):
    fault = {"kind": "cut", "channel": "force", "start": 0.0, "duration": 1.0}
    scenario = varied(clocks={"lvdt": {"wander": 1e-5}}, faults=[fault])
    assert scenario.clocks.lvdt.drift == 1e-5
    assert scenario.faults[0].kind == "missing"
    assert "wander" not in scenario.model_dump_json(by_alias=True)
