"""Trajectories of single moves."""

import numpy as np
import pytest

from bench.sequencer.trajectory import plan_approach


def test_approach_starts_and_ends_at_rest_within_its_limits():
    approach = plan_approach(-0.03, 0.01)
    assert approach.displacement[[0, -1]] == pytest.approx([-0.03, 0.01], abs=1e-12)
    velocity = np.diff(approach.displacement) * approach.rate
    assert np.max(np.abs(velocity)) <= 0.031
    assert np.max(np.abs(np.diff(velocity))) * approach.rate <= 0.31


def test_approach_to_the_present_position_takes_no_time():
    approach = plan_approach(0.01, 0.01)
    assert approach.duration == 0.0
    assert approach.displacement.tolist() == [0.01]
