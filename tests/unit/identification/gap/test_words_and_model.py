import json

import numpy as np
import pytest
from numpy.random import default_rng

from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.errors import IdentificationError
from identification.gap.black_box import explainable
from identification.gap.documents import EffectSet, EffectValue, Gap, NamedEffect
from identification.gap.model import named_effects, read_model
from identification.gap.plausible import plausibility
from identification.gap.words import advice, explanation, nearest
from identification.simulate import ActiveEffect

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


def scenario(tmp_path, **changed):
    document = {"schema": "mrbench.scenario/1", "damper": "laboratory", "effects": []} | changed
    path = tmp_path / "scenario.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_an_explanation_has_figures_units_the_cause_and_what_to_check():
    text = explanation("explained", GAP, [MASS], [EffectSet(effects=["force_delay"], probability=0.2)], "")
    for word in ("12 N", "2.5 N", "moving_mass", "2.1 kg", "98 %", "weigh", "force_delay"):
        assert word in text
    assert text.count(". ") == 1


def test_what_nothing_explains_says_where_it_is_largest():
    text = explanation("unexplained", GAP, [], [], "What remains is largest at 0.5 V.")
    assert "no known effect" in text
    assert "0.5 V" in text


def test_every_effect_has_its_own_advice():
    said = [advice(name) for name in EFFECTS]
    assert len(set(said)) == len(said)


def test_a_scenario_is_a_model_with_its_effects(tmp_path):
    effect = {"name": "moving_mass", "form": "rigid", "parameters": {"mass": 2.0}}
    model = read_model(scenario(tmp_path, effects=[effect]))
    assert named_effects(model.effects) == [effect]
    assert model.baseline is None
    by_numbers = scenario(tmp_path, damper=PARAMETER_SETS["laboratory"].parameters._asdict())
    assert read_model(by_numbers).point == pytest.approx(model.point)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(IdentificationError, match="cannot be read"):
        read_model(tmp_path / "nothing.json")


def test_structure_is_explainable_and_noise_is_not():
    random = default_rng(0)
    features = random.standard_normal((8000, 4))
    noise = random.standard_normal(8000)
    train = np.arange(8000) % 4 != 2
    structure = 3.0 * np.sin(features[:, 0]) * features[:, 1]
    assert explainable(features, structure + noise, train, ~train, 1.0) > 0.8
    assert explainable(features, 2.0 * noise, train, ~train, 1.0) < 0.1


def test_absurd_sizes_count_for_little():
    x = np.linspace(-0.01, 0.01, 100)
    bent = EFFECTS["displacement_nonlinearity"]
    slight, absurd = ActiveEffect(bent, (1e-4, 0.0, 0.01)), ActiveEffect(bent, (4e-3, 0.0, 0.01))
    assert plausibility(slight, x) == 1.0
    assert plausibility(absurd, x) < 0.1
    drift = EFFECTS["force_drift"]
    assert plausibility(ActiveEffect(drift, (5.0, 60.0)), x) == 1.0
    assert plausibility(ActiveEffect(drift, (5.0, 3.0)), x) < 0.1
    stop = EFFECTS["end_stop"]
    assert plausibility(ActiveEffect(stop, (2e4, 0.006, 1e-3)), x) == 1.0
    assert plausibility(ActiveEffect(stop, (5e3, 2e-4, 0.03)), x) < 0.1


def test_what_comes_nearest_is_said_with_what_it_leaves():
    words = nearest(["clevis_backlash", "shear_thinning"], 67.3, 52.7, 3.1)
    assert "clevis_backlash with shear_thinning" in words
    assert "from 67.3 to 52.7 N, 17 times the noise floor" in words
