"""Strokes of a trial as commands and as a method document."""

import numpy as np
import pytest

from sim_rig.trial.cases.specimens import SIZES, draw_specimen, make_scenario_document
from sim_rig.trial.cases.strokes import (
    PlannedStroke,
    compute_duration,
    make_method_document,
    make_strokes,
    sample_strokes,
)

SINE = PlannedStroke(0.01, 2.0, 3.0, (0.1, 0.4, 0.2))
REST = PlannedStroke(0.0, 1.0, 4.0, (0.3,))


def test_duration_includes_two_fades_of_half_a_second_for_each_stroke():
    assert compute_duration((SINE, REST)) == 9.0


def test_stroke_is_a_sine_faded_in_and_out_under_equal_shares_of_its_drives():
    displacement, drive = sample_strokes((SINE,))
    assert (len(displacement), len(drive)) == (4001, 4000)
    counted = np.arange(0, 3000) / 1000
    assert displacement[500:3500] == pytest.approx(0.01 * np.sin(4 * np.pi * counted), abs=1e-12)
    quarter = 0.103515625  # of the smooth step, at a quarter of the fade
    assert displacement[[0, 4000]] == pytest.approx([0, 0])
    assert displacement[125] == pytest.approx(0.01 * np.sin(-1.5 * np.pi) * quarter)
    assert displacement[3875] == pytest.approx(0.01 * np.sin(1.5 * np.pi) * quarter)
    assert np.flatnonzero(np.diff(drive)).tolist() == [1499, 2499]
    assert [drive[0], drive[1500], drive[-1]] == [0.1, 0.4, 0.2]


def test_rest_has_no_motion():
    displacement, drive = sample_strokes((REST, SINE))
    assert len(drive) == 9000
    assert (np.abs(displacement[:5000]).max(), set(drive[:5000])) == (0.0, {0.3})


@pytest.mark.parametrize(
    ("stroke", "name", "motion", "drive"),
    [
        (
            SINE,
            "0_10mm_2Hz",
            {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2.0},
            {"kind": "staircase", "levels": (0.1, 0.4, 0.2)},
        ),
        (REST, "0_rest", {"kind": "hold"}, {"kind": "staircase", "levels": (0.3,)}),
        (
            SINE._replace(duration=1.2),
            "0_10mm_2Hz",
            {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2.0},
            {"kind": "steps", "time_s": [0.0, 0.4, 0.8], "values": (0.1, 0.4, 0.2)},
        ),
    ],
)
def test_segment_of_the_method_has_motion_and_drive_of_the_stroke(stroke, name, motion, drive):
    document = make_method_document("m", "small", (stroke,))
    (segment,) = document["segments"]
    assert segment == {
        "name": name, "motion": motion, "fade_s": 0.5, "duration_s": stroke.duration, "drive": drive
    }  # fmt: skip


def test_limits_of_the_method_are_those_of_the_damper_with_a_margin():
    document = make_method_document("m", "large", (REST,))
    assert document["rate_hz"] == 1000.0
    assert document["limits"] == {
        "stroke_m": pytest.approx(0.06), "velocity_mps": 1.0, "acceleration_mps2": 30.0, "force_n": 24000.0,
        "drive": 1.0,
    }  # fmt: skip


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(5))
def test_drawn_strokes_are_within_the_stroke_and_drive_of_the_damper(size, seed):
    strokes = make_strokes("rich", size, seed, 0)
    limits = SIZES[size]
    moving = [stroke for stroke in strokes if stroke.amplitude]
    ratios = [stroke.amplitude / limits.stroke for stroke in moving]
    for ratio, nominal in zip(ratios, (0.45, 1.0, 1.0, 0.75, 0.25), strict=True):
        assert 0.9 * nominal - 0.006 <= ratio <= nominal + 0.006
    for stroke, nominal in zip(moving, (2.6, 0.6, 1.8, 1.25, 4.0), strict=True):
        assert 0.85 * nominal - 0.006 <= stroke.frequency <= 1.15 * nominal + 0.006
        assert stroke.duration * stroke.frequency == pytest.approx(round(stroke.duration * stroke.frequency))
        assert 0 <= min(stroke.drives) <= max(stroke.drives) <= limits.drive
    cycles = [stroke.duration * stroke.frequency / len(stroke.drives) for stroke in moving]
    assert [cycles[k] for k in (0, 1, 2, 4)] == pytest.approx([7, 2, 5, 9])
    steps = moving[3]
    assert len(steps.drives) == int(steps.duration / 0.4)
    assert [(s.duration, s.drives) for s in strokes if not s.amplitude] == [(4.0, (0.0,))] * 2


def test_scenario_of_a_specimen_has_an_actuator_of_two_and_a_half_times_its_force():
    document = make_scenario_document("large", draw_specimen("large", 3), seed=5)
    assert document["actuator"] == {"force": 6000.0}
    assert (document["drive_kind"], document["drive_unit"], document["seed"]) == ("coil_a", "A", 5)
    assert make_scenario_document("small", {})["drive_unit"] == "V"


@pytest.mark.parametrize("size", SIZES)
def test_specimens_differ_from_their_base_by_at_most_two_deviations(size):
    from identification.damper import Parameters, to_coordinates

    base = SIZES[size].base
    for seed in range(20):
        drawn = to_coordinates(Parameters(**draw_specimen(size, seed)))
        for symbol, value in base._asdict().items():
            found = getattr(drawn, symbol)
            if symbol == "rho":
                assert 0.25 - 1e-9 <= found <= 0.8 + 1e-9
            elif symbol == "n":
                assert found >= 1.3 - 1e-9
            else:
                assert abs(found) == pytest.approx(abs(value), rel=np.expm1(0.3) + 1e-6)
