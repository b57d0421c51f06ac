"""Reversals of the slip."""

import numpy as np
import pytest

from identification.pinn.common.reversals import find_reversals, find_turning_points


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
