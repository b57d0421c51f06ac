from collections import Counter
from typing import get_args

import numpy as np
import pytest

from sim_rig.effect_forms import FORMS, Place
from sim_rig.trial.cases import draw as drawing
from sim_rig.trial.cases.draw import (
    KNOWN_FORMS,
    RATIOS,
    UNKNOWN_FORMS,
    SampledCase,
    draw_cases,
    draw_grid,
    size_case,
)
from sim_rig.trial.cases.parameter_values import compute_measures, draw_values
from sim_rig.trial.cases.sizing import SizingModel, find_size
from sim_rig.trial.cases.specimens import SIZES, draw_specimen
from sim_rig.trial.cases.strokes import (
    RATE,
    RunKind,
    compute_duration,
    make_method_document,
    make_strokes,
    sample_strokes,
)


@pytest.fixture(scope="module")
def blind():
    return draw_cases(230, 7)


def test_the_draw_depends_on_the_seed_only(blind):
    assert draw_cases(230, 7) == blind
    assert draw_cases(230, 8) != blind


def test_kinds_have_their_proportions(blind):
    kinds = Counter(case.kind for case in blind)
    assert kinds == {"single": 58, "pair": 33, "triple": 9, "nothing": 100, "unknown": 30}


def test_the_beginning_is_a_fair_sample(blind):
    for count in (46, 115):
        kinds = Counter(case.kind for case in blind[:count])
        for kind, expected in drawing.CASE_COUNTS.items():
            assert abs(kinds[kind] - expected * count / 230) <= 1


def test_half_are_small_a_third_are_poor_and_every_damper_and_noise_occurs(blind):
    sizes = Counter(case.magnitude for case in blind if case.forms)
    assert abs(sizes["small"] - sizes["large"]) < 0.05 * sum(sizes.values())
    assert abs(Counter(case.method for case in blind)["poor"] - 230 / 3) < 4
    assert {case.damper for case in blind} == set(SIZES)
    assert {case.noise for case in blind} == {"white", "coloured"}


def test_all_effects_occur_equally_often(blind):
    counts = Counter(form for case in blind for form in case.forms)
    assert set(counts) == set(FORMS)
    assert max(counts[form] for form in KNOWN_FORMS) - min(counts[form] for form in KNOWN_FORMS) <= 2


def test_only_unknown_cases_have_unknown_effects(blind):
    for case in blind:
        assert all((form in UNKNOWN_FORMS) == (case.kind == "unknown") for form in case.forms)


def test_ratios_are_those_of_the_magnitude(blind):
    for case in blind:
        for ratio in case.ratios:
            low, high = RATIOS[case.magnitude]
            assert low <= ratio <= high


def test_at_most_one_effect_acts_in_the_mounting(blind):
    for case in blind:
        assert sum(FORMS[form].place is Place.MOUNTING for form in case.forms) <= 1
        assert len(set(case.forms)) == len(case.forms)


def test_a_grid_has_every_effect_at_every_size():
    cases = draw_grid(16 * len(drawing.GRID_RATIOS), 3)
    assert Counter((c.forms[0], c.ratios[0]) for c in cases) == Counter(
        (f, r) for f in KNOWN_FORMS for r in drawing.GRID_RATIOS
    )
    assert {case.kind for case in cases} == {"single"}


@pytest.mark.parametrize("kind", get_args(RunKind))
@pytest.mark.parametrize("size", SIZES)
def test_methods_respect_the_limits_of_the_damper_and_two_minutes(kind, size):
    strokes = make_strokes(kind, size, 4, 1)
    displacement, drive = sample_strokes(strokes)
    assert np.max(np.abs(displacement)) <= SIZES[size].stroke
    assert np.max(np.abs(np.diff(displacement))) * RATE < 0.5
    assert (drive.min(), drive.max()) == (0.0, SIZES[size].drive)
    assert len(displacement) == len(drive) + 1
    assert compute_duration(strokes) < 120
    moving = [stroke for stroke in strokes if stroke.amplitude]
    assert len({stroke.frequency for stroke in moving}) == {"poor": 1, "validation_poor": 2}.get(kind, 5)
    names = [segment["name"] for segment in make_method_document("m", size, strokes)["segments"]]
    assert len(set(names)) == len(names)


def test_a_validation_run_has_other_strokes():
    for method in ("rich", "poor"):
        training, validation = (
            make_strokes(method, "middle", 4, 1),
            make_strokes(f"validation_{method}", "middle", 4, 1),
        )
        assert not {s.frequency for s in training if s.amplitude} & {
            s.frequency for s in validation if s.amplitude
        }


def test_a_damper_is_defined_by_its_seed():
    assert draw_specimen("small", 3) == draw_specimen("small", 3)
    assert draw_specimen("small", 3) != draw_specimen("small", 4)


def test_values_are_within_the_bounds_of_their_form():
    generator = np.random.default_rng(1)
    for size in SIZES:
        measures = compute_measures(size, 60.0, SIZES[size].stroke)
        for name, form in FORMS.items():
            values = draw_values(name, generator, measures)
            assert list(values) == [quantity.symbol for quantity in form.parameters]
            assert all(q.low <= values[q.symbol] <= q.high for q in form.parameters)


def test_a_size_with_the_requested_excess_is_found():
    effect = {"name": "seal_friction", "form": "lugre", "parameters": {"sliding": 1.0, "peak": 0.7}}
    sized, excess = find_size(effect, 2.0, lambda candidate: 0.03 * candidate["parameters"]["sliding"] ** 1.6)
    assert excess == pytest.approx(2.0, rel=0.06)
    assert sized["parameters"]["sliding"] == pytest.approx((2.0 / 0.03) ** (1 / 1.6), rel=0.05)
    assert sized["parameters"]["peak"] == 0.7


def test_an_excess_that_cannot_be_reached_gives_the_largest_size():
    effect = {"name": "magnetic_remanence", "form": "closing_loop", "parameters": {"share": 0.3, "width": 0.1}}
    sized, excess = find_size(effect, 5.0, lambda candidate: candidate["parameters"]["share"])
    assert (sized["parameters"]["share"], excess) == (1.0, 1.0)


@pytest.fixture(scope="module")
def sizing_model():
    time = np.arange(2001) / RATE
    drive = np.where(time[:-1] < 1, 0.1, 0.4)
    return SizingModel("small", draw_specimen("small", 1), 0.008 * np.sin(4 * np.pi * time), drive)


def test_a_force_that_the_law_can_fit_has_no_excess(sizing_model):
    """A gas column much longer than the stroke is nearly the linear spring of the law."""
    linear = {"preload": 90.0, "length": 1.0, "exchange": 60.0}
    progressive = {"preload": 90.0, "length": 0.025, "exchange": 60.0}
    gas = {"name": "gas_spring", "form": "gas_with_wall"}
    assert sizing_model.compute_residual({**gas, "parameters": linear}) < 0.02 * sizing_model.compute_residual(
        {**gas, "parameters": progressive}
    )


def test_an_error_of_the_displacement_channel_has_an_excess(sizing_model):
    error = {"name": "displacement_nonlinearity", "form": "uneven_winding"}
    assert (
        sizing_model.compute_residual({**error, "parameters": {"error": 2e-4, "position": 3e-3, "width": 4e-3}})
        > 1.0
    )


def test_a_sized_case_has_the_requested_ratios(monkeypatch, sizing_model):
    monkeypatch.setattr(drawing, "make_sizing_model", lambda *_: sizing_model)
    sampled = SampledCase(
        3, "pair", "large", "poor", 0, "small", "coloured", ("lugre", "warm_up_and_walk"), (2.0, 3.0), 9
    )
    case = size_case(sampled, 1)
    assert [effect.name for effect in case.effects] == ["seal_friction", "force_drift"]
    assert [effect.ratio for effect in case.effects] == pytest.approx([2.0, 3.0], rel=0.06)
    assert case.scenario["alternative_effects"] == [
        {"name": e.name, "form": e.form, "parameters": e.parameters} for e in case.effects
    ]
    assert case.scenario["sensors"]["force"]["slow_noise"] > 0
    assert size_case(sampled, 1) == case


def test_an_effect_that_cannot_be_large_enough_is_replaced(monkeypatch, sizing_model):
    """Under a constant drive a lag of the coil has no influence."""
    time = np.arange(1001) / RATE
    constant = SizingModel(
        "small", draw_specimen("small", 1), 0.008 * np.sin(4 * np.pi * time), np.full(1000, 0.2)
    )
    monkeypatch.setattr(drawing, "make_sizing_model", lambda *_: constant)
    sampled = SampledCase(0, "single", "large", "poor", 0, "small", "white", ("eddy_ladder",), (3.0,), 9)
    (effect,) = size_case(sampled, 1).effects
    assert effect.form != "eddy_ladder"
    assert effect.in_library
