"""Time maps within one element."""

import numpy as np
import pytest

from identification.pinn.common.time_map import TimeMap, make_linear_map, make_reversal_map

STEP = 1e-6


def test_a_time_map_runs_from_zero_to_one_with_its_own_rates():
    time_map = TimeMap(0.3, 0.04, 0.005)
    time = np.linspace(0.01, 0.29, 30)
    value, rate, change = time_map.evaluate(time)
    ends, _, _ = time_map.evaluate(np.array([0.0, 0.3]))
    assert ends == pytest.approx([0.0, 1.0], abs=1e-12)
    assert time_map.invert(value) == pytest.approx(time, rel=1e-12)
    later, rate_later, _ = time_map.evaluate(time + STEP)
    assert (later - value) / STEP == pytest.approx(rate, rel=1e-3)
    assert (rate_later - rate) / STEP == pytest.approx(change, rel=2e-3, abs=1e-2)


def test_a_reversal_map_is_finest_at_the_breakthrough():
    time = np.linspace(0.0, 0.3, 3001)
    slip_velocity = 0.04 * np.sin(np.pi * time / 0.3)
    time_map = make_reversal_map(0.3, time, slip_velocity, 1e-4)
    slip = 0.04 * 0.3 / np.pi * (1 - np.cos(np.pi * time / 0.3))
    assert np.interp(time_map.centre, time, slip) == pytest.approx(1.3e-4, rel=1e-2)
    assert time[np.argmax(time_map.evaluate(time)[1])] == pytest.approx(time_map.centre, abs=2e-4)


def test_a_linear_map_is_time_to_a_hundredth():
    value, rate, _ = make_linear_map(0.2).evaluate(np.linspace(0.0, 0.2, 11))
    assert value == pytest.approx(np.linspace(0.0, 1.0, 11), abs=1e-2)
    assert rate == pytest.approx(5.0, rel=0.03)
