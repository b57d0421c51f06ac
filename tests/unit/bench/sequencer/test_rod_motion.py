"""Moves of the rod without a run."""

import itertools
import threading
import time

import pytest

from bench.errors import InterlockError, RunError
from bench.sequencer.rod_motion import move_rod
from drivers.errors import NoReplyError, RefusedError
from tests.support.fake_rig import FakeActuator

TIMEOUT = 10.0


def move(actuator, target=0.0005, permit=lambda position: None, stop_requested=None, active=None, **more):
    report_active = ([] if active is None else active).append
    stop_requested = stop_requested or threading.Event()
    move_rod(actuator, permit, time.monotonic_ns, report_active, target, stop_requested, **more)


def test_rod_arrives_smoothly_and_the_drive_is_left_without_voltage():
    actuator, active = FakeActuator(), []
    move(actuator, active=active)
    assert actuator.positions[-1] == pytest.approx(0.0005)
    assert all(after >= before for before, after in itertools.pairwise(actuator.positions))
    assert actuator.calls == ["actuator armed", "actuator disabled"]
    assert active == [True, False]


def test_forbidden_target_is_refused_before_the_drive_is_armed():
    def permit(position):
        raise InterlockError("outside")

    actuator = FakeActuator()
    with pytest.raises(InterlockError, match="outside"):
        move(actuator, permit=permit)
    assert actuator.calls == []


def test_stopped_move_ends_before_its_target_with_an_error():
    stop_requested, actuator = threading.Event(), FakeActuator()
    stopping = threading.Thread(target=lambda: actuator.moving.wait(TIMEOUT) and stop_requested.set())
    stopping.start()
    with pytest.raises(RunError, match="the move was stopped"):
        move(actuator, target=0.009, stop_requested=stop_requested)
    stopping.join()
    assert 0 < actuator.positions[-1] < 0.009
    assert actuator.calls[-1] == "actuator disabled"


def test_move_that_is_stopped_before_its_begin_arms_nothing():
    (stop_requested := threading.Event()).set()
    actuator = FakeActuator()
    with pytest.raises(RunError, match="stopped before it began"):
        move(actuator, stop_requested=stop_requested)
    assert actuator.calls == []


def test_failed_drive_is_made_safe_and_its_error_raised():
    actuator = FakeActuator(refuses_at=3)
    with pytest.raises(RefusedError, match="stopped by itself"):
        move(actuator)
    assert actuator.calls == ["actuator armed", "actuator safe"]


def test_rod_that_does_not_arrive_is_an_error():
    actuator = FakeActuator()
    with pytest.raises(RunError, match="has not arrived"):
        move(actuator, target=0.009, time_margin=-1.0)
    assert actuator.calls[-1] == "actuator safe"


def test_drive_that_cannot_be_armed_receives_no_setpoint():
    actuator = FakeActuator()

    def arm():
        raise NoReplyError("actuator: no reply")

    actuator.arm = arm
    with pytest.raises(NoReplyError, match="no reply"):
        move(actuator)
    assert actuator.positions == []


def test_rest_that_the_drive_does_not_confirm_is_not_reported_as_rest():
    actuator = FakeActuator(refuses_at=3)
    actuator.unconfirmed = "actuator: no reply"
    with pytest.raises(RunError, match="the rod's rest is not confirmed: actuator: no reply"):
        move(actuator)
