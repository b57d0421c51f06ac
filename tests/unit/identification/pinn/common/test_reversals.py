"""Reversals of the slip."""

import numpy as np
import pytest

from identification.pinn.common.reversals import find_reversals, find_turning_points, integrate_slip


def test_reversals_are_those_of_the_slip_and_sign_changes_near_zero_velocity_do_not_count():
    time = np.arange(0.0, 2.0, 1e-3)
    slip_velocity = 0.05 * np.cos(2 * np.pi * time)
    slip_velocity[np.abs(time - 0.25) < 0.02] = 1e-4 * np.sin(400 * time[np.abs(time - 0.25) < 0.02])
    reversals = find_reversals(time, slip_velocity, 1e-3)
    assert len(reversals) == 4
    assert reversals[1:] == pytest.approx([0.75, 1.25, 1.75], abs=1e-3)
    assert reversals[0] == pytest.approx(0.25, abs=0.025)


def test_a_signal_leaves_its_turning_points_by_more_than_the_threshold():
    assert find_turning_points(np.array([0.0, 1.0, 0.7, 1.2, -1.0, 0.0, 2.0, 0.0]), 0.5) == [3, 4, 6]


@pytest.mark.parametrize(
    ("values", "turns"),
    [
        ([0.0, 1.0, 0.5, 1.0, 0.5], []),  # 0.5 is not left by more than 0.5
        ([0.0, 1.0, 0.5, 1.5, 0.9, 3.0], [3, 4]),
        ([0.0, -1.0, -0.4, -2.0], [1, 2]),
        ([0.0, -1.0, 1.0, 0.4, 1.2, 0.6, 0.0, 0.7], [1, 2, 3, 4, 6]),
    ],
)
def test_turning_points_are_the_extremes_that_it_leaves(values, turns):
    assert find_turning_points(np.array(values), 0.5) == turns


def test_slip_is_the_trapezoidal_integral_of_the_slip_velocity():
    slip = integrate_slip(np.array([0.0, 1.0, 3.0, 3.5]), np.array([0.0, 2.0, 4.0, -2.0]))
    assert slip == pytest.approx([0.0, 1.0, 7.0, 7.5])


def test_a_reversal_is_interpolated_to_the_zero_of_the_velocity():
    time, velocity = np.arange(8.0) * 0.1, np.array([-1.0, -1.0, 3.0, 1.0, -3.0, -1.0, 0.5, 0.5])
    # Zeros at a quarter between samples 1 and 2, 3 and 4, and two thirds between 5 and 6.
    assert find_reversals(time, velocity, 0.01) == pytest.approx([0.125, 0.325, 0.5 + 0.2 / 3.0])


@pytest.mark.parametrize(("yield_displacement", "count"), [(0.19, 2), (0.21, 0)])
def test_an_excursion_of_less_than_half_the_yield_displacement_is_no_reversal(yield_displacement, count):
    # The slip falls by 1, rises by 1, falls by 0.1 and rises again: reversals at 1, 2 and 2.1.
    time = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 2.1, 2.1, 3.0])
    velocity = np.array([-1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    reversals = find_reversals(time, velocity, yield_displacement)
    assert reversals == pytest.approx([1.0, 2.0, 2.1][: 1 + count])
