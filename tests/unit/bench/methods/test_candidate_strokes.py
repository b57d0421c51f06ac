"""Candidate strokes: amplitudes, frequencies and drives from the limits of a method."""

import pytest

from bench.methods import Method, compile_method
from bench.methods.candidate_strokes import make_candidate_strokes

LIMITS = {"stroke_m": 0.05, "velocity_mps": 0.1, "acceleration_mps2": 1.5, "force_n": 2000, "drive": 0.5}


@pytest.fixture(scope="module")
def make_candidates():
    def make(motion):
        segment = {"name": "a", "motion": motion, "duration_s": 2, "drive": {"kind": "constant", "value": 0.1}}
        document = {"schema": "mrbench.method/1", "name": "m", "title": "t", "description": "d", "rate_hz": 1000}
        document |= {"drive_kind": "coil_v", "limits": LIMITS, "segments": [segment]}
        return make_candidate_strokes(compile_method(Method.model_validate(document)))

    return make


@pytest.fixture(scope="module")
def candidates(make_candidates):
    return make_candidates({"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 1})


def test_frequencies_follow_from_nine_tenths_of_the_limit_reached_first(candidates):
    """10 mm: velocity, 0.9 0.1 / (2 pi 0.01) = 1.43 Hz; 2 mm: acceleration, 0.9 sqrt(750) / (2 pi) = 3.92 Hz."""
    assert {(one.motion.kind, one.motion.amplitude_m, one.motion.frequency_hz) for one, _ in candidates} == {
        ("sine", 0.01, 1.4),
        ("sine", 0.005, 2.4),
        ("sine", 0.002, 3.9),
        ("sine", 0.002, 1.5),
    }


def test_name_of_a_candidate_gives_amplitude_frequency_and_drive(candidates):
    assert [one.name for one, _ in candidates if one.drive.kind != "steps"] == [
        "add_sine_10mm_1.4Hz_highest",
        "add_sine_5mm_2.4Hz_highest",
        "add_sine_2mm_3.9Hz_highest",
        "add_sine_2mm_1.5Hz_levels",
        "add_sine_2mm_1.5Hz_highest",
    ]


def test_drives_extend_to_the_limit_of_the_method(candidates):
    by_name = {one.name: one for one, _ in candidates}
    assert by_name["add_sine_2mm_1.5Hz_levels"].drive.levels == (0, 0.12, 0.25, 0.37, 0.5)
    assert by_name["add_sine_2mm_1.5Hz_highest"].drive.value == 0.5
    steps = by_name["add_sine_2mm_1.5Hz_steps"].drive
    assert (steps.time_s[:3], steps.values[:4]) == ((0, 0.5, 1.0), (0.1, 0.5, 0, 0.3))


def test_without_motion_in_the_method_amplitudes_are_shares_of_half_the_stroke(make_candidates):
    amplitudes = {one.motion.amplitude_m for one, _ in make_candidates({"kind": "hold"})}
    assert amplitudes <= {0.025, 0.012, 0.005}
    assert 0.005 in amplitudes
