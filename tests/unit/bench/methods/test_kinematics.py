"""Smooth steps, moves and fades against values computed by hand from the quintic."""

import numpy as np
import pytest

from bench.methods.kinematics import (
    Kinematics,
    apply_fade,
    compute_move,
    compute_move_duration,
    compute_smooth_step,
)


def at(kinematics, index=0):
    return [float(values[index]) for values in kinematics]


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        (-1.0, (0, 0, 0)),
        (0.0, (0, 0, 0)),
        (0.25, (0.103515625, 1.0546875, 5.625)),
        (0.5, (0.5, 1.875, 0)),
        (0.75, (0.896484375, 1.0546875, -5.625)),
        (1.0, (1, 0, 0)),
        (2.0, (1, 0, 0)),
    ],
)
def test_smooth_step_has_the_values_of_the_quintic(share, expected):
    assert at(compute_smooth_step(np.array([share]))) == pytest.approx(expected)


def test_move_scales_the_step_with_distance_and_duration():
    found = compute_move(0.01, 0.05, 2.0, np.array([0.5]))
    assert at(found) == pytest.approx((0.014140625, 0.02109375, 0.05625))


@pytest.mark.parametrize(
    ("distance", "velocity", "acceleration", "duration"),
    [
        (0.02, 0.05, 100.0, 0.8),  # 1.875 0.02 / 0.05 = 0.75 s
        (-0.02, 0.05, 100.0, 0.8),
        (0.02, 1.0, 0.05, 1.6),  # sqrt(5.7735 0.02 / 0.05) = 1.52 s
        (-0.02, 1.0, 0.05, 1.6),
    ],
)
def test_duration_of_a_move_is_the_limit_reached_first_rounded_up(distance, velocity, acceleration, duration):
    assert compute_move_duration(distance, velocity, acceleration) == pytest.approx(duration)


@pytest.mark.parametrize(
    ("steady", "time", "expected"),
    [
        ((2, 0, 0), -2.0, (0, 0, 0)),
        ((2, 0, 0), -1.5, (0.20703125, 1.0546875, 2.8125)),
        ((2, 0, 0), 11.5, (0.20703125, -1.0546875, 2.8125)),
        ((0, 3, 7), -1.5, (0, 0.310546875, 0.724609375 + 3.1640625)),
        ((0, 3, 7), 11.5, (0, 0.310546875, 0.724609375 - 3.1640625)),
        ((2, 3, 7), 5.0, (2, 3, 7)),
    ],
)
def test_fade_multiplies_a_motion_by_the_smooth_step(steady, time, expected):
    motion = Kinematics(*(np.array([float(value)]) for value in steady))
    assert at(apply_fade(motion, np.array([time]), 10.0, 2.0)) == pytest.approx(expected)
