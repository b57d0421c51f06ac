import threading

import pytest

from sim_rig.live.clock import RunningClock, SteppedClock


def test_a_running_clock_starts_at_zero_and_is_monotonic():
    clock = RunningClock()
    readings = [clock.now_ns() for _ in range(1000)]
    assert 0 <= readings[0] < 60_000_000_000  # not the reading of the system clock
    assert readings == sorted(readings)


def test_a_running_clock_waits_for_an_instant():
    clock = RunningClock(speed=100.0)
    while not clock.wait_until(200_000_000):
        pass
    assert clock.now_ns() >= 200_000_000


def test_a_wait_for_a_running_clock_ends_by_its_timeout():
    assert not RunningClock(speed=1e-6).wait_until(10**9, timeout=1e-3)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_speed_that_is_not_positive_is_refused(speed):
    with pytest.raises(ValueError, match="must be above 0"):
        RunningClock(speed)


def test_a_stepped_clock_moves_only_when_it_is_advanced():
    clock = SteppedClock()
    assert not clock.wait_until(5, timeout=1e-3)
    clock.advance(5)
    assert clock.now_ns() == 5
    assert clock.wait_until(5)


def test_a_stepped_clock_wakes_a_waiting_thread():
    clock, woken = SteppedClock(), []
    waiter = threading.Thread(target=lambda: woken.append(clock.wait_until(10, timeout=30.0)))
    waiter.start()
    clock.advance(4)
    clock.advance(6)
    waiter.join(30.0)
    assert woken == [True]


def test_a_stepped_clock_refuses_a_negative_step():
    with pytest.raises(ValueError, match="run back by 1 ns"):
        SteppedClock().advance(-1)
