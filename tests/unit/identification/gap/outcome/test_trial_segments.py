"""Trial segments: strokes inside the limits of a recording, with hand-computed sizes."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.outcome.trial_segments import StrokeLimits, generate_trial_segments

LIMITS = StrokeLimits(amplitude=0.015, centre=0.002, velocity=0.3, frequency=3.0, drives=(0.0, 0.5))


def find(name, limits=LIMITS):
    """The segment with a name and its excitation."""
    (found,) = [(s, e) for s, e in generate_trial_segments(limits) if s["name"] == name]
    return found


def list_motions(limits):
    motions = [
        s["motion"] for s, _ in generate_trial_segments(limits) if s["drive"] == {"kind": "constant", "value": 0.0}
    ]
    return [(m["kind"], m["amplitude_m"], m["frequency_hz"]) for m in motions]


def test_motions_reach_the_limits_of_velocity_and_twice_the_recorded_frequency():
    # 0.3 m/s / (2 pi 0.015 m) = 3.18 Hz; smaller amplitudes are limited to 2 x 3 Hz.
    # Triangle: 0.3 x 0.3 m/s / (4 x 0.015 m) = 1.5 Hz.
    assert list_motions(LIMITS) == [
        ("sine", 0.015, 3.18), ("sine", 0.015, 1.27), ("sine", 0.015, 0.477),
        ("sine", 0.0075, 6.0), ("sine", 0.0075, 2.4), ("sine", 0.0075, 0.9),
        ("sine", 0.003, 6.0), ("sine", 0.003, 2.4), ("sine", 0.003, 0.9),
        ("triangle", 0.015, 1.5),
    ]  # fmt: skip


def test_no_frequency_is_below_a_fifth_of_a_hertz():
    slow = list_motions(replace(LIMITS, velocity=0.02))
    assert [f for _, _, f in slow[:3]] == [0.212, 0.2, 0.2]
    assert slow[-1] == ("triangle", 0.015, 0.2)


def test_the_corner_acceleration_follows_amplitude_and_squared_frequency():
    segment, _ = find("next_triangle_15mm_1.5Hz_0")
    assert segment["motion"]["corner_acceleration_mps2"] == 10.1  # 300 x 0.015 x 1.5^2 = 10.125


def test_drives_are_three_constants_and_a_staircase_up_and_down():
    drives = [s["drive"] for s, _ in generate_trial_segments(LIMITS)][:4]
    assert drives == [
        {"kind": "constant", "value": 0.0},
        {"kind": "constant", "value": 0.25},
        {"kind": "constant", "value": 0.5},
        {"kind": "staircase", "levels": [0.0, 0.25, 0.5, 0.25, 0.0]},
    ]
    single = [s["drive"] for s, _ in generate_trial_segments(replace(LIMITS, drives=(0.2, 0.2)))]
    assert single == [{"kind": "constant", "value": 0.2}] * 10


@pytest.mark.parametrize(
    ("name", "cycles"),
    [
        ("next_sine_15mm_3.18Hz_0", 19),  # 6 s x 3.18 Hz = 19.1
        ("next_sine_15mm_3.18Hz_steps", 20),  # 5 levels of 3.8 cycles
        ("next_sine_15mm_0.477Hz_0.25", 3),
        ("next_sine_15mm_0.477Hz_steps", 5),  # at least one cycle at each level
    ],
)
def test_a_segment_lasts_about_six_seconds_in_whole_cycles(name, cycles):
    segment, excitation = find(name)
    assert segment["cycles"] == cycles
    assert segment["centre_m"] == 0.002
    assert segment["fade_s"] == 0.5
    frequency = segment["motion"]["frequency_hz"]
    assert len(excitation.displacement) == round(1000.0 * cycles / frequency)
    assert excitation.rate == 1000.0


def test_a_sine_has_its_exact_derivatives():
    _, e = find("next_sine_7.5mm_2.4Hz_0.5")
    omega, k = 2 * np.pi * 2.4, 57
    angle = omega * k / 1000.0
    assert e.displacement[k] == pytest.approx(0.002 + 0.0075 * np.sin(angle))
    assert e.velocity[k] == pytest.approx(0.0075 * omega * np.cos(angle))
    assert e.acceleration[k] == pytest.approx(-0.0075 * omega**2 * np.sin(angle))
    assert set(e.drive) == {0.5}


def test_a_triangle_has_rounded_corners_at_its_amplitude():
    _, e = find("next_triangle_15mm_1.5Hz_0")
    assert np.ptp(e.displacement) == pytest.approx(0.03, rel=1e-4)
    assert e.displacement[0] == pytest.approx(0.002)
    # Slope at the centre: 0.015 x 0.98 x 2 pi 1.5 / arcsin(0.98) = 0.1011 m/s.
    assert e.velocity[1] == pytest.approx(0.1011, rel=1e-3)
    assert np.abs(e.velocity).max() == pytest.approx(0.1011, rel=1e-3)
    assert e.acceleration[10:20] == pytest.approx(np.gradient(e.velocity, 1e-3)[10:20])


def test_the_levels_of_a_staircase_last_equally_long():
    _, e = find("next_sine_15mm_3.18Hz_steps")
    changes = np.flatnonzero(np.diff(e.drive)) + 1
    assert e.drive[[0, *changes]].tolist() == [0.0, 0.25, 0.5, 0.25, 0.0]
    assert changes / len(e.drive) == pytest.approx([0.2, 0.4, 0.6, 0.8], abs=1e-3)
