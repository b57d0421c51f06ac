import threading

import pytest

from sim_rig.clock import RunningClock, SteppedClock


def test_a_running_clock_begins_at_zero_and_never_runs_back():
    clock = RunningClock()
    seen = [clock.now_ns() for _ in range(1000)]
    assert 0 <= seen[0] < 60_000_000_000  # and not where the system's own clock stands
    assert seen == sorted(seen)


def test_a_running_clock_waits_for_an_instant():
    clock = RunningClock(speed=100.0)
    while not clock.wait_until(200_000_000):
        pass
    assert clock.now_ns() >= 200_000_000


def test_a_running_clock_gives_up_when_its_patience_ends():
    assert not RunningClock(speed=1e-6).wait_until(10**9, patience=1e-3)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_clock_that_does_not_move_on_is_refused(speed):
    with pytest.raises(ValueError, match="has to be above 0"):
        RunningClock(speed)


def test_a_stepped_clock_stands_still_until_it_is_moved():
    clock = SteppedClock()
    assert not clock.wait_until(5, patience=1e-3)
    clock.advance(5)
    assert clock.now_ns() == 5
    assert clock.wait_until(5)


def test_a_stepped_clock_wakes_who_waits():
    clock, woken = SteppedClock(), []
    waiter = threading.Thread(target=lambda: woken.append(clock.wait_until(10, patience=30.0)))
    waiter.start()
    clock.advance(4)
    clock.advance(6)
    waiter.join(30.0)
    assert woken == [True]


def test_a_stepped_clock_refuses_to_run_back():
    with pytest.raises(ValueError, match="run back by 1 ns"):
        SteppedClock().advance(-1)
