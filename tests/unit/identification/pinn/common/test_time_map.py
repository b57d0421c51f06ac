"""Time maps within one element."""

import numpy as np
import pytest

from identification.pinn.common.time_map import (
    TimeMap,
    make_default_map,
    make_linear_map,
    make_reversal_map,
    make_slip_times,
    make_step_map,
)

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


@pytest.mark.parametrize("velocity", [0.01, -0.01])
@pytest.mark.parametrize(
    ("yield_displacement", "centre", "width"),
    [
        (1e-4, 0.013, 0.013),  # slips of 0.7, 1.3 and 2 yield displacements after 7, 13 and 20 ms
        (1e-2, 0.1755, 0.1755),  # the whole slip is 3 mm; at most 0.9 of it counts as two yield displacements
        (1e-6, 1.3e-4, 5e-4),  # the smallest width
    ],
)
def test_a_reversal_map_follows_the_slip(yield_displacement, centre, width, velocity):
    time = np.linspace(0.0, 0.3, 31)
    time_map = make_reversal_map(0.3, time, np.full(31, velocity), yield_displacement)
    assert (time_map.length, time_map.centre, time_map.width) == pytest.approx((0.3, centre, width))


def test_maps_without_a_reversal_are_finest_at_their_start():
    assert make_step_map(0.3, 50.0) == TimeMap(0.3, 0.0, 0.02)
    assert make_step_map(0.3, 1e5) == TimeMap(0.3, 0.0, 5e-4)
    assert make_default_map(0.2) == TimeMap(0.2, 0.0, 0.2)
    assert make_linear_map(0.2) == TimeMap(0.2, 0.0, 1.0)


def test_slip_times_are_denser_after_the_reversal():
    times = make_slip_times(0.2)
    assert times[[0, -1]] == pytest.approx([0.0, 0.2])
    assert times[1] == pytest.approx(0.2 / 149.0**1.5)
