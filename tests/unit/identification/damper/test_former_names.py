"""Former names of forms and parameters: older twins and scenarios are read, and only present names are written."""

import json

import pytest

from identification.damper import find_parameter_set
from identification.damper.effects import EFFECTS, rename_form, rename_parameters
from identification.damper.effects.former_names import FORMER_FORMS, FORMER_PARAMETERS
from identification.errors import IdentificationError
from identification.fitting import make_effect_entries, read_damper_model
from sim_rig.errors import ScenarioError
from sim_rig.scenario import parse_scenario
from tests.support.effects import MEDIUM

FORMS = [(effect, old, new) for effect, names in FORMER_FORMS.items() for old, new in names.items()]
OLD_EFFECTS = [
    {"name": "clevis_backlash", "form": "greased_pin", "parameters": {"gap": 1e-4, "softness": 2e-4, "film": 5e3}},
    {
        "name": "viscous_heating",
        "form": "partly",
        "parameters": {"softening": 1e-3, "recovery": 40.0, "part": 0.4},
    },
    {"name": "coil_lag", "form": "deeply_slow", "parameters": {"lag": 0.02, "part": 0.4}},
    {"name": "displacement_nonlinearity", "parameters": {"bow": 1e-4, "curve": -2e-4, "reach": 0.012}},
    {"name": "force_delay", "form": "pure_delay", "parameters": {"delay": 0.002}},
]
PRESENT = [
    ("greased_pin", {"gap": 1e-4, "contact_compliance": 2e-4, "film_damping": 5e3}),
    ("partial", {"softening": 1e-3, "recovery_time": 40.0, "yield_exponent": 0.4}),
    ("two_layer_lag", {"lag": 0.02, "slow_fraction": 0.4}),
    ("saturating", {"even": 1e-4, "odd": -2e-4, "reach": 0.012}),
    ("pure_delay", {"delay": 0.002}),
]


def old_document(effects=OLD_EFFECTS, **more):
    damper = find_parameter_set("laboratory").parameters._asdict()
    return json.dumps({"schema": "mrbench.scenario/1", "damper": damper, "effects": effects, **more})


@pytest.mark.parametrize(("effect", "old", "new"), FORMS, ids=[f"{effect}-{old}" for effect, old, _ in FORMS])
def test_a_former_form_is_found_under_its_present_name(effect, old, new):
    names = [form.name for form in EFFECTS[effect].forms]
    assert old not in names
    assert EFFECTS[effect].find_form(old).name == new == rename_form(effect, old)


@pytest.mark.parametrize("effect", FORMER_PARAMETERS)
def test_every_former_parameter_has_a_present_one(effect):
    symbols = {q.symbol for form in EFFECTS[effect].forms for q in form.parameters}
    assert set(FORMER_PARAMETERS[effect].values()) <= symbols
    assert symbols.isdisjoint(FORMER_PARAMETERS[effect])


@pytest.mark.parametrize("effect", EFFECTS)
def test_present_names_stay(effect):
    for form in EFFECTS[effect].forms:
        values = dict(zip([q.symbol for q in form.parameters], MEDIUM[effect][form.name], strict=True))
        assert rename_form(effect, form.name) == form.name
        assert rename_parameters(effect, values) == values


def test_waves_of_older_documents_continue_after_their_recording():
    assert rename_parameters("force_drift", {"cosine": 1.0, "period": 50.0})["end"] == 1e5
    assert "end" not in rename_parameters("force_drift", {"change": 1.0, "duration": 50.0})


def test_an_old_twin_is_read_and_written_with_the_present_names(tmp_path):
    twin = tmp_path / "twin.json"
    twin.write_text(old_document())
    entries = make_effect_entries(read_damper_model(twin).effects)
    assert [(e["form"], e["parameters"]) for e in entries] == PRESENT


def test_an_old_scenario_is_read_and_written_with_the_present_names():
    effects = parse_scenario(old_document(), "of a test").model_dump(mode="json")["effects"]
    assert [e["parameters"] for e in effects] == [parameters for _, parameters in PRESENT]
    assert [e["form"] for e in effects] == ["greased_pin", "partial", "two_layer_lag", None, "pure_delay"]


def test_a_parameter_under_both_names_is_refused(tmp_path):
    twice = [{"name": "clevis_backlash", "form": "free_pin",
              "parameters": {"gap": 1e-4, "softness": 1e-4, "contact_compliance": 2e-4}}]  # fmt: skip
    twin = tmp_path / "twin.json"
    twin.write_text(old_document(twice))
    with pytest.raises(IdentificationError, match="softness and contact_compliance; keep one"):
        read_damper_model(twin)
    with pytest.raises(ScenarioError, match="softness and contact_compliance; keep one"):
        parse_scenario(old_document(twice), "of a test")
