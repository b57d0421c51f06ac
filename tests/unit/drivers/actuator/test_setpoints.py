"""Setpoints are checked by the times at which they were due, not those at which they were sent."""

from types import SimpleNamespace

import pytest

from drivers.actuator.servo_drive import ActuatorSettings
from drivers.actuator.setpoints import SetpointSender
from drivers.channel import Channel
from drivers.errors import OutOfRangeError

MS = 1_000_000
TRAVEL = Channel("actuator_position", "m", -0.05, 0.05, "read_write", "")
SAMPLES = SimpleNamespace(last_ns=None, statusword=None, decode_pending=lambda: None)
SPEED = 0.2


class Bench:
    """Sends setpoints of a steady motion of 0.2 m/s at given instants; 0.5 m/s are allowed."""

    def __init__(self):
        self.now, self.sent, self.heartbeat_count = 0, [], 0
        node = SimpleNamespace(
            heartbeat=SimpleNamespace(boot_count=0, check_alive=lambda: None),
            send_process_data=self.sent.append,
            send_heartbeat=self.count_heartbeat,
        )
        drive = SimpleNamespace(faults=())
        self.setpoints = SetpointSender("rod", node, drive, lambda: self.now, ActuatorSettings(), 127)
        self.setpoints.arm(0.0)

    def count_heartbeat(self, master):
        self.heartbeat_count += 1

    def send(self, now_ms, due_ms, position_ms=None):
        """Send a setpoint at one instant that was due at another, with the position of a third."""
        self.now = round(now_ms * MS)
        position = SPEED * (due_ms if position_ms is None else position_ms) * 1e-3
        self.setpoints.send(position, 0.0, TRAVEL, SAMPLES, due_ms * MS)


def test_late_setpoints_may_be_caught_up():
    """One is sent 15.9 ms late, the next ones at once, and then one replaces five."""
    bench = Bench()
    for now, due in ((4, 4), (8, 8), (27.9, 12), (28, 16), (28.1, 20), (40.2, 40), (44, 44)):
        bench.send(now, due)
    assert len(bench.sent) == 7


def test_a_setpoint_that_was_blocked_while_sending_is_caught_up_at_once():
    """It was sent 30 ms late; the next one replaces eight and follows immediately."""
    bench = Bench()
    for now, due in ((4, 4), (8, 8), (42, 12), (42.1, 44), (48, 48)):
        bench.send(now, due)
    assert len(bench.sent) == 5


def test_a_due_time_in_the_future_is_ignored():
    bench = Bench()
    bench.send(4, 4)
    with pytest.raises(OutOfRangeError):
        bench.send(8, 100, 100)


def test_a_jump_between_punctual_setpoints_is_refused():
    bench = Bench()
    for due in (4, 8, 12):
        bench.send(due, due)
    with pytest.raises(
        OutOfRangeError, match=r"m/s from the last setpoint, 0\.5 m/s are allowed; nothing was sent"
    ):
        bench.send(16, 16, 30)
    assert len(bench.sent) == 3


def test_a_jump_after_a_long_silence_is_refused():
    bench = Bench()
    bench.send(4, 4)
    bench.send(104, 104, 44)
    with pytest.raises(OutOfRangeError):
        bench.send(108, 108, 60)


def test_without_a_due_time_the_clock_is_used():
    bench = Bench()
    bench.send(4, 4)
    bench.now = 8 * MS
    with pytest.raises(OutOfRangeError):
        bench.setpoints.send(SPEED * 0.03, 0.0, TRAVEL, SAMPLES)
    bench.now = 28 * MS
    bench.setpoints.send(SPEED * 0.03, 0.0, TRAVEL, SAMPLES)
    assert len(bench.sent) == 2


def test_only_punctual_setpoints_bring_a_heartbeat():
    bench = Bench()
    for due in range(4, 200, 4):
        bench.send(due, due)
    punctual = bench.heartbeat_count
    for k in range(10):
        bench.send(220 + 24 * k, 196)
    assert punctual > 0
    assert bench.heartbeat_count == punctual
