"""Samples of each motion against values computed by hand."""

import math

import numpy as np
import pytest

from bench.methods.motion import MotionTable, Multisine, Ramp, Random, Sine, Sweep, Triangle
from bench.methods.motion_samples import sample_motion

PI = math.pi
HALF = math.sqrt(0.5)
SINE = Sine(kind="sine", amplitude_m=0.01, frequency_hz=2)
RAMP = Ramp(kind="ramp", start_m=0.1, end_m=-0.06, corner_acceleration_mps2=1)
"""Trapezoid of 0.16 m in 1 s: 0.2 m/s between corners of 0.2 s."""
TRIANGLE = Triangle(kind="triangle", amplitude_m=0.01125, frequency_hz=2, corner_acceleration_mps2=4)
"""Triangle of 0.1 m/s with corners of 0.025 s on both sides of each end."""
LINEAR = Sweep(kind="sweep", amplitude_m=1, start_hz=1, end_hz=3)
LOGARITHMIC = Sweep(kind="sweep", amplitude_m=1, start_hz=1, end_hz=4, law="logarithmic")
TABLE = MotionTable(kind="table", time_s=(0, 1, 2), displacement_m=(0, 1, 0))
ANGLE = 2 * PI / math.log(2)
"""Phase of the logarithmic sweep when it reaches 2 Hz, after 1 s [rad]."""


@pytest.mark.parametrize(
    ("motion", "duration", "time", "expected"),
    [
        (SINE, 3.0, 1 / 16, (0.01 * HALF, 0.04 * PI * HALF, -0.16 * PI**2 * HALF)),
        (RAMP, 1.0, -1.0, (0.1, 0, 0)),
        (RAMP, 1.0, 0.0, (0.1, 0, 0)),
        (RAMP, 1.0, 0.1, (0.095, -0.1, -1)),
        (RAMP, 1.0, 0.4, (0.04, -0.2, 0)),
        (RAMP, 1.0, 0.6, (0.0, -0.2, 0)),
        (RAMP, 1.0, 0.9, (-0.055, -0.1, 1)),
        (RAMP, 1.0, 2.0, (-0.06, 0, 0)),
        (TRIANGLE, 1.0, -0.05, (-0.005, 0.1, 0)),
        (TRIANGLE, 1.0, 0.05, (0.005, 0.1, 0)),
        (TRIANGLE, 1.0, 0.12, (0.0112, 0.02, -4)),
        (TRIANGLE, 1.0, 0.13, (0.0112, -0.02, -4)),
        (TRIANGLE, 1.0, 0.2, (0.005, -0.1, 0)),
        (TRIANGLE, 1.0, 0.3, (-0.005, -0.1, 0)),
        (TRIANGLE, 1.0, 0.37, (-0.0112, -0.02, 4)),
        (TRIANGLE, 1.0, 0.38, (-0.0112, 0.02, 4)),
        (TRIANGLE, 1.0, 0.55, (0.005, 0.1, 0)),
        (LINEAR, 2.0, -0.25, (-1, 0, 4 * PI**2)),
        (LINEAR, 2.0, 0.5, (-HALF, -3 * PI * HALF, -2 * PI * HALF + 9 * PI**2 * HALF)),
        (LINEAR, 2.0, 1.0, (0, -4 * PI, -2 * PI)),
        (LINEAR, 2.0, 2.25, (-1, 0, 36 * PI**2)),
        (LOGARITHMIC, 2.0, -0.25, (-1, 0, 4 * PI**2)),
        (
            LOGARITHMIC,
            2.0,
            1.0,
            (
                math.sin(ANGLE),
                4 * PI * math.cos(ANGLE),
                4 * PI * math.log(2) * math.cos(ANGLE) - 16 * PI**2 * math.sin(ANGLE),
            ),
        ),
        (TABLE, 4.0, -0.5, (0, 0, 6)),
        (TABLE, 4.0, 0.25, (0.15625, 1.125, 3)),
        (TABLE, 4.0, 1.0, (1, 0, -6)),
        (TABLE, 4.0, 2.25, (0.15625, 1.125, 3)),
        (TABLE, 4.0, 4.0, (0, 0, 6)),
    ],
)
def test_motion_has_displacement_velocity_and_acceleration_of_its_formula(motion, duration, time, expected):
    found = sample_motion(motion, np.array([time]), duration)
    assert [float(values[0]) for values in found] == pytest.approx(expected, abs=1e-9)


def compute_line_amplitudes(values):
    return np.abs(np.fft.rfft(values)) / (len(values) / 2)


def test_random_motion_has_equal_lines_from_the_lower_to_the_upper_edge_of_its_band():
    motion = Random(kind="random", spectrum={"low_hz": 2, "high_hz": 5, "rms_m": 1}, seed=1)
    found = sample_motion(motion, np.arange(100) / 100, 1.0)
    frequency = np.arange(51)
    line = np.where((frequency >= 2) & (frequency <= 5), HALF, 0)  # four lines: 1 = sqrt(4 / 2) amplitude
    for order, values in enumerate(found):
        assert compute_line_amplitudes(values) == pytest.approx(line * (2 * PI * frequency) ** order, abs=1e-9)
    assert np.sum(found.displacement * found.acceleration) < 0
    assert np.fft.rfft(found.velocity)[3] == pytest.approx(6j * PI * np.fft.rfft(found.displacement)[3])


def test_multisine_is_the_sum_of_its_lines():
    motion = Multisine(
        kind="multisine",
        lines=({"frequency_hz": 3, "amplitude_m": 0.5}, {"frequency_hz": 4, "amplitude_m": 0.2}),
        seed=1,
    )
    found = sample_motion(motion, np.arange(100) / 100, 1.0)
    for order, values in enumerate(found):
        amplitudes = compute_line_amplitudes(values)
        assert amplitudes[[3, 4]] == pytest.approx([0.5 * (6 * PI) ** order, 0.2 * (8 * PI) ** order])
        assert np.delete(amplitudes, [3, 4]).max() < 1e-9
