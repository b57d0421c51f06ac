"""Texts of a diagnosis for a person."""

import json
from types import SimpleNamespace

import pytest

from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.documents.diagnosis import EffectSet, EffectValue, NamedEffect
from identification.errors import IdentificationError
from identification.fitting.damper_model import make_effect_entries, read_damper_model
from identification.gap.outcome.explanation import (
    describe_discovery,
    describe_nearest,
    explain_diagnosis,
    suggest_check,
    summarise_diagnosis,
)
from tests.support.discovery_documents import make_discovery
from tests.support.gaps import GAP

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


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (1.63e-5, "m", "gap width 16.3 µm)"),
        (0.0123, "m", "gap width 12.3 mm)"),
        (1.5, "m", "gap width 1.5 m)"),
        (0.0042, "s", "gap width 4.2 ms)"),
        (2e-4, "1/N", "gap width 0.0002 1/N)"),
        (0.5, "1", "gap width 0.5)"),
    ],
)
def test_sizes_have_units_that_suit_them(value, unit, shown):
    size = {"gap_width": EffectValue(value=value, unit=unit, ci95=(value, value))}
    assert shown in explain_diagnosis("explained", GAP, [MASS.model_copy(update={"parameters": size})], [], "")


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


def test_two_effects_reduce_the_error_together_and_close_no_more_than_all_of_the_gap():
    spring = MASS.model_copy(update={"name": "gas_spring"})
    gap = GAP.model_copy(update={"shrinkage": 1.04})
    text = explain_diagnosis("explained", gap, [MASS, spring], [], "")
    assert "together reduce this error to 3 N and close 100 % of the gap" in text
    assert " reduces this error to 3 N and closes 98 % of the gap" in explain_diagnosis(
        "explained", GAP, [MASS], [], ""
    )
    unknown = GAP.model_copy(update={"shrinkage": None})
    assert "reduces this error to 3 N. Check" in explain_diagnosis("explained", unknown, [MASS], [], "")


@pytest.mark.parametrize(("probability", "mentioned"), [(0.1, True), (0.099, False)])
def test_alternatives_are_mentioned_from_a_tenth_on(probability, mentioned):
    others = [EffectSet(effects=[], probability=probability), EffectSet(effects=["a", "b"], probability=0.2)]
    text = explain_diagnosis("explained", GAP, [MASS], others, "")
    assert ("would also allow no effect at all or a with b)" in text) == mentioned
    assert "would also allow" in text


def test_a_gap_of_noise_needs_nothing():
    text = explain_diagnosis("no_gap", GAP, [], [], "")
    assert "is 12 N, and noise accounts for 2.5 N of it. Nothing needs" in text


@pytest.mark.parametrize(
    ("effects", "gap", "message", "summary"),
    [
        (
            [MASS],
            GAP,
            "Checked.",
            "moving_mass 80%; held-out force error 12 to 3 N, noise floor 2.5 N, shrinkage 0.98. Checked",
        ),
        (
            [],
            GAP.model_copy(update={"shrinkage": None}),
            None,
            "no effect named; held-out force error 12 to 3 N, noise floor 2.5 N",
        ),
    ],
)
def test_a_summary_has_effects_errors_and_cross_check_in_one_line(effects, gap, message, summary):
    check = message and SimpleNamespace(message=message)
    diagnosis = SimpleNamespace(verdict="explained", effects=effects, gap=gap, cross_check=check, discovery=None)
    assert summarise_diagnosis(diagnosis) == f"explained: {summary}"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "the formula a*displacement**2 at the damper gain, over displacement,"),
        ({"formula": None}, "an estimated curve at the damper gain, over displacement,"),
        (
            {"formula": None, "place": "parallel_force", "variables": ["travel_since_rest", "velocity", "drive"]},
            "an estimated curve at the parallel force, over travel since rest and velocity and drive,",
        ),
    ],
)
def test_a_cause_outside_the_library_is_described_with_its_place_and_errors(changes, text):
    note = describe_discovery(make_discovery(**changes), 12.0)
    assert note == f"outside the library: {text} reduces the error on held-out strokes from 12 to 2.75 N"


def test_a_summary_has_the_cause_outside_the_library_before_the_cross_check():
    diagnosis = SimpleNamespace(
        verdict="unexplained", effects=[], gap=GAP, cross_check=SimpleNamespace(message="Checked."),
        discovery=make_discovery(),
    )  # fmt: skip
    summary = summarise_diagnosis(diagnosis)
    assert f"shrinkage 0.98; {describe_discovery(make_discovery(), 12.0)}. Checked" in summary
    diagnosis.discovery = None
    assert "outside the library" not in summarise_diagnosis(diagnosis)
