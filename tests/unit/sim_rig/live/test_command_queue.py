import numpy as np
import pytest

from sim_rig.live.command_queue import LinearInterpolator, ZeroOrderHold


def test_a_held_command_lasts_until_the_next():
    signal = ZeroOrderHold(0.1)
    signal.add(20, 0.2)
    signal.add(30, 0.3)
    assert signal.evaluate(np.array([0, 19, 20, 29])).tolist() == [0.1, 0.1, 0.2, 0.2]
    assert signal.evaluate(np.array([30, 31])).tolist() == [0.3, 0.3]


def test_the_later_of_two_commands_for_one_instant_applies():
    signal, interpolated = ZeroOrderHold(0.0), LinearInterpolator(0.0, 10)
    for value in (1.0, 2.0):
        signal.add(5, value)
        interpolated.add(5, value)
    assert signal.evaluate(np.array([5])).tolist() == [2.0]
    assert interpolated.evaluate(np.array([15])).tolist() == [2.0]


def test_frequent_commands_are_joined_by_straight_lines_after_the_transition_time():
    signal = LinearInterpolator(0.0, 10)
    for at in range(0, 100, 4):
        signal.add(at, 3.0 * at)
    assert signal.evaluate(np.arange(10, 100)) == pytest.approx(3.0 * np.arange(0, 90))


def test_a_single_command_is_not_followed_before_its_arrival():
    signal = LinearInterpolator(1.0, 10)
    signal.add(100, 2.0)
    assert signal.evaluate(np.array([0, 99, 100, 105, 110, 500])).tolist() == [1.0, 1.0, 1.0, 1.5, 2.0, 2.0]


def test_a_motion_commanded_in_advance_is_followed_between_distant_points():
    signal = LinearInterpolator(0.0, 10)
    for at in range(0, 300, 60):
        signal.add(at + 60, 3.0 * (at + 60), since_ns=at)
    assert signal.evaluate(np.arange(10, 310)) == pytest.approx(3.0 * np.arange(300))


def test_a_motion_commanded_in_advance_is_replaced_by_a_command_for_an_earlier_instant():
    signal = LinearInterpolator(0.0, 10)
    signal.add(60, 60.0, since_ns=0)
    signal.add(120, 120.0, since_ns=60)
    signal.add(70, 5.0)
    assert signal.evaluate(np.array([70, 80, 200])).tolist() == pytest.approx([60.0, 5.0, 5.0])


def test_a_late_command_is_followed_from_the_present_value():
    signal = LinearInterpolator(0.0, 10)
    signal.add(100, 1.0)
    assert signal.evaluate(np.array([150])).tolist() == [1.0]
    signal.add(105, 2.0)
    assert signal.evaluate(np.array([150, 151])).tolist() == [2.0, 2.0]


def test_past_commands_are_discarded():
    held, interpolated = ZeroOrderHold(0.0), LinearInterpolator(0.0, 2)
    for at in range(1000):
        held.add(at, at)
        interpolated.add(at, at)
        held.evaluate(np.array([at]))
        interpolated.evaluate(np.array([at]))
    assert len(held._points) == 1
    assert len(interpolated._vertices) < 5
