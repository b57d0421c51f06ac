"""Setpoints are checked by the times at which they were due, not those at which they were sent."""

from types import SimpleNamespace

import pytest

from drivers.actuator.servo_drive import ActuatorSettings
from drivers.actuator.setpoints import SetpointSender
from drivers.channel import Channel
from drivers.errors import OutOfRangeError, RefusedError

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


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("interval_ms", "allowed_mm"),
    [(4, 2.0), (1, 2.0), (20, 10.0), (50, 25.0), (80, 25.0)],  # at least one cycle, at most the setpoint timeout
)
def test_a_setpoint_may_be_half_a_metre_per_second_from_the_last_one(interval_ms, allowed_mm, sign):
    bench = Bench()
    bench.now = interval_ms * MS
    with pytest.raises(OutOfRangeError):
        bench.setpoints.send(sign * (allowed_mm + 1e-3) * 1e-3, 0.0, TRAVEL, SAMPLES)
    bench.setpoints.send(sign * (allowed_mm - 1e-3) * 1e-3, 0.0, TRAVEL, SAMPLES)
    assert len(bench.sent) == 1


def test_the_target_counts_from_home_in_tenths_of_a_micrometre():
    bench = Bench()
    bench.now = 4 * MS
    bench.setpoints.send(0.001, 0.0175, TRAVEL, SAMPLES)
    assert bench.sent == [{0x6040: 0x0F, 0x6060: 8, 0x607A: 185_000}]


def test_a_heartbeat_leaves_every_twenty_milliseconds():
    """The first one at 20 ms, as the clock begins at zero."""
    bench, counts = Bench(), []
    for due in range(4, 64, 4):
        bench.send(due, due)
        counts.append(bench.heartbeat_count)
    assert [4 * (counts.index(count) + 1) for count in (1, 2, 3)] == [20, 40, 60]


@pytest.mark.parametrize(("interval_ms", "count"), [(8, 1), (8.1, 0)])
def test_a_setpoint_within_two_cycles_is_punctual(interval_ms, count):
    bench = Bench()
    bench.send(20, 20, 4)
    bench.heartbeat_count, bench.setpoints._heartbeat_ns = 0, -MS * 100
    bench.send(20 + interval_ms, 20, 4)
    assert bench.heartbeat_count == count


@pytest.mark.parametrize(
    ("sampled_ms", "statusword", "is_refused"),
    [(0, 0x27, False), (0, 0x07, True), (-1, 0x07, False), (0, None, False)],
)
def test_a_drive_that_left_operation_after_arming_is_refused(sampled_ms, statusword, is_refused):
    bench, samples = Bench(), SimpleNamespace(last_ns=sampled_ms * MS, statusword=statusword)
    bench.now = 4 * MS
    if is_refused:
        with pytest.raises(RefusedError, match="stopped by itself: quick stop active"):
            bench.setpoints.send(0.0, 0.0, TRAVEL, samples)
        assert not bench.setpoints.is_armed
    else:
        bench.setpoints.send(0.0, 0.0, TRAVEL, samples)


@pytest.mark.parametrize(("age_ms", "is_decoded"), [(24, False), (24.001, True)])
def test_pending_frames_are_decoded_if_no_sample_was_taken_for_three_polls(age_ms, is_decoded):
    bench, decoded = Bench(), []
    bench.now = 1000 * MS
    last_ns = bench.now - round(age_ms * MS)
    samples = SimpleNamespace(last_ns=last_ns, statusword=0x27, decode_pending=lambda: decoded.append(1))
    bench.setpoints.send(0.0, 0.0, TRAVEL, samples)
    assert bool(decoded) is is_decoded
