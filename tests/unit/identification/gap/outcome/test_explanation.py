"""Texts of a diagnosis for a person."""

import json

import pytest

from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.documents.diagnosis import EffectSet, EffectValue, Gap, NamedEffect
from identification.errors import IdentificationError
from identification.fitting.damper_model import make_effect_entries, read_damper_model
from identification.gap.outcome.explanation import describe_nearest, explain_diagnosis, suggest_check

GAP = Gap(
    before_n=12.0,
    after_n=3.0,
    noise_floor_n=2.5,
    shrinkage=0.98,
    shrinkage_ci95=(0.97, 0.99),
    train_before_n=11.0,
    train_after_n=3.0,
)
MASS = NamedEffect(
    name="moving_mass",
    stage="mounting",
    form="rigid",
    parameters={"mass": EffectValue(value=2.1, unit="kg", ci95=(2.0, 2.2))},
    share=1.0,
    probability=0.8,
)


def write_scenario(tmp_path, **changed):
    document = {"schema": "mrbench.scenario/1", "damper": "laboratory", "effects": []} | changed
    path = tmp_path / "scenario.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_an_explanation_states_sizes_cause_and_check_in_two_sentences():
    text = explain_diagnosis("explained", GAP, [MASS], [EffectSet(effects=["force_delay"], probability=0.2)], "")
    for word in ("12 N", "2.5 N", "moving_mass", "2.1 kg", "98 %", "weigh", "force_delay"):
        assert word in text
    assert text.count(". ") == 1


def test_without_a_known_cause_the_explanation_locates_the_remainder():
    text = explain_diagnosis("unexplained", GAP, [], [], "The remainder is largest at 0.5 V.")
    assert "no known effect" in text
    assert "0.5 V" in text


def test_every_effect_has_a_check_of_its_own():
    checks = [suggest_check(name) for name in EFFECTS]
    assert len(set(checks)) == len(checks)


def test_a_scenario_is_a_model_with_its_effects(tmp_path):
    effect = {"name": "moving_mass", "form": "rigid", "parameters": {"mass": 2.0}}
    model = read_damper_model(write_scenario(tmp_path, effects=[effect]))
    assert make_effect_entries(model.effects) == [effect]
    assert model.baseline is None
    by_numbers = write_scenario(tmp_path, damper=PARAMETER_SETS["laboratory"].parameters._asdict())
    assert read_damper_model(by_numbers).coordinates == pytest.approx(model.coordinates)


def test_a_missing_scenario_is_refused(tmp_path):
    with pytest.raises(IdentificationError, match="cannot be read"):
        read_damper_model(tmp_path / "nothing.json")


def test_the_closest_known_effects_are_noted_with_their_errors():
    note = describe_nearest(["clevis_backlash", "shear_thinning"], 67.3, 52.7, 3.1)
    assert "clevis_backlash with shear_thinning" in note
    assert "from 67.3 to 52.7 N, 17 times the noise floor" in note


def test_the_remainder_follows_the_checks_of_a_partly_explained_gap():
    text = explain_diagnosis("partly_explained", GAP, [MASS], [], "The remainder is largest at 0.5 V.")
    assert text.endswith("; the remainder is largest at 0.5 V.")
