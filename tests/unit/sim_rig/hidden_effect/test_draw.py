"""Draw of a hidden effect: determined by its seed, valid, and visible on the six-drive sine method."""

import numpy as np
import pytest

from bench.methods import load_method
from identification.damper import PARAMETER_SETS
from identification.damper.effects import COMMON_EFFECTS
from sim_rig.effect_forms import FORMS
from sim_rig.hidden_effect import SIZE_RANGES, draw_scenario
from sim_rig.hidden_effect.draw import DURATION, STROKE
from sim_rig.plant import make_plant
from sim_rig.trial.cases.sizing import SizingModel
from sim_rig.trial.cases.strokes import PlannedStroke, sample_strokes

SEEDS = range(200)
LOAD_CELL_NOISE = 2.5
"""[N] of the default rig."""
SHORTENED_METHOD = (
    PlannedStroke(0.01, 1.0, 12.0, (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)),
    PlannedStroke(0.005, 2.5, 5.0, (0.0, 0.3, 0.1, 0.5, 0.2, 0.4, 0.0, 0.5, 0.3, 0.1)),
)
"""The six-drive sine method with two cycles at each drive, and a third of its drive steps."""


@pytest.fixture(scope="module")
def effects():
    return {seed: draw_scenario(seed).alternative_effects[0] for seed in SEEDS}


@pytest.fixture(scope="module")
def sizing_model():
    parameters = PARAMETER_SETS["laboratory"].parameters._asdict()
    return SizingModel("small", parameters, *sample_strokes(SHORTENED_METHOD))


def test_the_same_seed_gives_the_same_damper(effects):
    assert draw_scenario(7) == draw_scenario(7)
    assert len({effect.model_dump_json() for effect in effects.values()}) == len(SEEDS)


def test_every_common_effect_of_the_library_is_drawn(effects):
    assert {effect.name for effect in effects.values()} == set(COMMON_EFFECTS)
    assert {FORMS[form].effect for form in SIZE_RANGES} == set(COMMON_EFFECTS)


def test_values_are_within_the_bounds_of_their_form_and_sizes_within_their_range(effects):
    for effect in effects.values():
        form = FORMS[effect.form]
        assert all(q.low <= effect.parameters[q.symbol] <= q.high for q in form.parameters)
        sizes = SIZE_RANGES[effect.form]
        assert sizes.low <= effect.parameters[form.parameters[0].symbol] <= sizes.high


def test_the_rest_of_the_rig_is_the_default_one():
    drawn, default = draw_scenario(5).model_dump(), draw_scenario(6).model_dump()
    assert {key for key in drawn if drawn[key] != default[key]} == {"alternative_effects", "seed"}
    assert drawn["damper"] == "laboratory"


@pytest.mark.parametrize("form", SIZE_RANGES)
def test_the_first_damper_of_each_form_shows_its_effect(form, effects, sizing_model):
    effect = next(effect for effect in effects.values() if effect.form == form)
    document = {"name": effect.name, "form": effect.form, "parameters": effect.parameters}
    assert sizing_model.compute_residual(document) > LOAD_CELL_NOISE


def test_the_rig_can_start_with_every_form(effects):
    for form in SIZE_RANGES:
        seed = next(seed for seed, effect in effects.items() if effect.form == form)
        plant = make_plant(draw_scenario(seed))
        assert np.isfinite(plant.advance(1e-3, 0.0, 0.1).force).all()


def test_values_refer_to_the_strokes_of_the_method_that_the_demo_records():
    first, second = load_method("six_voltages").segments
    assert first.motion.amplitude_m == STROKE
    cycles = first.cycles / first.motion.frequency_hz + second.cycles / second.motion.frequency_hz
    assert cycles == pytest.approx(DURATION, abs=2.5)
