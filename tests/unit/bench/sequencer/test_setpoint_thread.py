"""Setpoint generator on a clock that the test steps; setpoint thread with a failing generator."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from bench.errors import InterlockError, RunError
from bench.sequencer.command_history import CommandHistory
from bench.sequencer.playback import PlaybackSection
from bench.sequencer.setpoint_thread import SetpointGenerator, SetpointThread
from bench.sequencer.trajectory import STOP_TIMES, ScheduledTrajectory
from tests.support.fake_rig import CYCLE, FakeActuator, step_cycles
from tests.support.methods import constant, programme, sine

TIMEOUT = 0.05
TWO_SEGMENTS = programme(sine("a", 0.01, 2.0, constant(0.2)), sine("b", 0.005, 4.0, constant(0.4)))
SECTION = PlaybackSection(TWO_SEGMENTS, 0, len(TWO_SEGMENTS.time) - 1)


@pytest.fixture
def actuator():
    return FakeActuator()


@pytest.fixture
def generator(actuator):
    return make_generator(actuator)


def make_generator(actuator, permit=lambda position: None):
    return SetpointGenerator(actuator, permit, CommandHistory(), CYCLE, TIMEOUT)


def find_demand(actuator):
    """Return the positions of the programme one cycle after each setpoint."""
    elapsed = (np.array(actuator.due_ns) - actuator.due_ns[0]) * 1e-9
    return np.interp(elapsed + CYCLE, TWO_SEGMENTS.time, TWO_SEGMENTS.displacement)


def test_setpoint_is_the_position_one_cycle_later(generator, actuator):
    assert generator.start(SECTION.trajectory, SECTION)
    step_cycles(generator, 1_000_000_000, 1100)
    assert np.allclose(actuator.positions, find_demand(actuator), rtol=0, atol=1e-12)


def test_late_setpoints_stay_synchronous(generator, actuator):
    generator.start(SECTION.trajectory, SECTION)
    step_cycles(generator, 0, 1100, jitter=3_500_000)
    assert np.allclose(actuator.positions, find_demand(actuator), rtol=0, atol=1e-9)


@pytest.mark.parametrize("at", [0.3, 0.7, 1.1, 1.6, 2.9])
def test_soft_stop_at_any_time_stays_on_the_path_and_within_the_limits(generator, actuator, at):
    generator.start(SECTION.trajectory, SECTION)
    now = step_cycles(generator, 0, round(at / CYCLE))
    limits = TWO_SEGMENTS.method.limits
    generator.stop(now, limits.acceleration_mps2)
    before = len(actuator.positions)
    now = step_cycles(generator, now, round((STOP_TIMES[-1] + 0.1) / CYCLE))
    positions = np.array(actuator.positions)
    velocity = np.diff(positions) / CYCLE
    assert generator.is_done(now)
    assert np.all(velocity[-20:] == 0)
    assert np.max(np.abs(np.diff(velocity) / CYCLE)) <= 1.01 * limits.acceleration_mps2
    assert np.max(np.abs(velocity)) <= np.max(np.abs(TWO_SEGMENTS.velocity)) * 1.001
    assert np.min(TWO_SEGMENTS.displacement) <= positions.min()
    assert positions.max() <= np.max(TWO_SEGMENTS.displacement)
    assert np.flatnonzero(velocity)[-1] - before < 1.5 / CYCLE


def test_nothing_starts_after_a_stop(generator, actuator):
    generator.hold_at(0.001)
    now = step_cycles(generator, 0, 3)
    generator.stop(now, 8.0)
    assert not generator.start(SECTION.trajectory, SECTION)
    step_cycles(generator, now, 300)
    assert set(actuator.positions) == {0.001}


def test_suspension_withholds_setpoints_until_the_next_start(generator, actuator):
    generator.hold_at(0.0)
    now = step_cycles(generator, 0, 3)
    generator.suspend(now)
    now = step_cycles(generator, now, 5)
    assert len(actuator.positions) == 3
    assert generator.start(SECTION.trajectory, SECTION)
    step_cycles(generator, now, 1)
    assert isinstance(generator.schedule, ScheduledTrajectory)
    assert generator.schedule.begin_ns == now


def test_suspension_expires_before_the_drive_would_stop(generator, actuator):
    generator.hold_at(0.0)
    now = step_cycles(generator, 0, 3)
    generator.suspend(now)
    step_cycles(generator, now, round(TIMEOUT / CYCLE))
    assert len(actuator.positions) > 3
    assert not generator.start(SECTION.trajectory, SECTION)
    assert np.diff(actuator.due_ns).max() * 1e-9 < 0.8 * TIMEOUT


def test_forbidden_setpoint_is_not_sent(actuator):
    def permit(position):
        if abs(position) > 0.005:
            raise InterlockError("too far")

    generator = make_generator(actuator, permit)
    generator.start(SECTION.trajectory, SECTION)
    with pytest.raises(InterlockError):
        step_cycles(generator, 0, 1100)
    assert max(map(abs, actuator.positions)) <= 0.005


def test_internal_error_of_the_thread_is_reported_once():
    failures, failed = [], threading.Event()

    def step(now_ns):
        raise ZeroDivisionError("division by zero")

    def on_failed(error):
        failures.append(error)
        failed.set()

    generator = SimpleNamespace(cycle_ns=4_000_000, step=step)
    with SetpointThread(generator, time.monotonic_ns, lambda now_ns, delay: None, on_failed) as thread:
        assert failed.wait(10)
    assert failures == [thread.failure]
    assert isinstance(thread.failure, RunError)
    assert "ZeroDivisionError" in str(thread.failure)


def test_late_setpoints_keep_their_places_and_more_than_four_cycles_are_skipped(monkeypatch):
    """The thread wakes late by 0, 0, 5, 1, 17 and 16 ms; the clock begins 1 ms after a cycle of 4 ms."""
    now, overshoots, due, late = [10_001_000_000], iter([0, 0, 5, 0, 17, 16]), [], []

    def sleep(seconds):
        now[0] += round(seconds * 1e9) + next(overshoots) * 1_000_000

    def step(due_ns):
        due.append(due_ns)
        if len(due) == 6:
            thread._stopping.set()

    monkeypatch.setattr("bench.sequencer.setpoint_thread.time", SimpleNamespace(sleep=sleep))
    monkeypatch.setattr("bench.sequencer.setpoint_thread.raise_priority", lambda above: f"no priority {above}")
    generator = SimpleNamespace(cycle_ns=4_000_000, step=step)
    thread = SetpointThread(generator, lambda: now[0], lambda *one: late.append(one), pytest.fail)
    thread._run()
    assert [one / 1e9 for one in due] == [10.004, 10.008, 10.012, 10.016, 10.036, 10.040]
    assert late == [
        (10_017_000_000, pytest.approx(0.005)),
        (10_037_000_000, pytest.approx(0.017)),
        (10_056_000_000, pytest.approx(0.016)),
    ]
    assert (thread.late_cycles, thread.warning) == (1 + 4 + 4, "no priority 5")


@pytest.mark.parametrize(("elapsed_ns", "is_withheld"), [(30_000_000, True), (30_000_001, False)])
def test_suspension_lasts_three_fifths_of_the_setpoint_timeout(generator, elapsed_ns, is_withheld):
    generator.hold_at(0.0)
    generator.step(0)
    generator.suspend(1_000)
    assert generator.step(1_000 + elapsed_ns) is not is_withheld


def test_motion_is_done_one_cycle_after_its_end(generator):
    generator.start(SECTION.trajectory, SECTION)
    assert not generator.is_done(10**12)
    generator.step(7)
    end_ns = generator.schedule.end_ns + 4_000_000
    assert (generator.is_done(end_ns - 1), generator.is_done(end_ns)) == (False, True)


def test_nothing_is_sent_before_a_start(generator, actuator):
    assert generator.is_done(0)
    assert not generator.step(0)
    assert actuator.positions == []


def test_soft_stop_begins_after_the_setpoint_that_was_sent(generator):
    generator.start(SECTION.trajectory, SECTION)
    now = step_cycles(generator, 0, 100)
    generator.stop(now, 8.0)
    assert generator.schedule.soft_stop.start == pytest.approx((now + 4_000_000) * 1e-9)
