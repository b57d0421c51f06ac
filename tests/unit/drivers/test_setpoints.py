"""What may be sent to a drive, by the time of each setpoint's place and not of its sending."""

from types import SimpleNamespace

import pytest

from drivers.channel import Channel
from drivers.errors import OutOfRange
from drivers.servo_drive import ActuatorSettings
from drivers.setpoints import Setpoints

MS = 1_000_000
TRAVEL = Channel("actuator_position", "m", -0.05, 0.05, "read_write", "")
SAMPLES = SimpleNamespace(last_ns=None, statusword=None, catch_up=lambda: None)
SPEED = 0.2


class Bench:
    """Sends setpoints of a steady motion of 0.2 m/s at given instants; 0.5 m/s are allowed."""

    def __init__(self):
        self.now, self.sent, self.beats = 0, [], 0
        node = SimpleNamespace(boots=0, check_alive=lambda: None, lead=self.sent.append, send_heartbeat=self.beat)
        drive = SimpleNamespace(faults=())
        self.setpoints = Setpoints("rod", node, drive, lambda: self.now, ActuatorSettings(), 127)
        self.setpoints.arm(0.0)

    def beat(self, master):
        self.beats += 1

    def send(self, at_ms, place_ms, where_ms=None):
        """One that leaves at an instant, has its place at another, and a position of a third one."""
        self.now = round(at_ms * MS)
        position = SPEED * (place_ms if where_ms is None else where_ms) * 1e-3
        self.setpoints.send(position, 0.0, TRAVEL, SAMPLES, place_ms * MS)


def test_setpoints_that_were_held_up_are_made_up_for():
    """One leaves 15.9 ms late, the next ones at once, and then one that stands for five places."""
    bench = Bench()
    for at, place in ((4, 4), (8, 8), (27.9, 12), (28, 16), (28.1, 20), (40.2, 40), (44, 44)):
        bench.send(at, place)
    assert len(bench.sent) == 7


def test_one_that_is_held_up_on_its_way_is_made_up_for_at_once():
    """It had begun in time and left 30 ms late; the next one stands for eight places and follows upon it."""
    bench = Bench()
    for at, place in ((4, 4), (8, 8), (42, 12), (42.1, 44), (48, 48)):
        bench.send(at, place)
    assert len(bench.sent) == 5


def test_a_place_to_come_is_not_believed():
    bench = Bench()
    bench.send(4, 4)
    with pytest.raises(OutOfRange):
        bench.send(8, 100, 100)


def test_a_leap_in_a_row_that_is_on_time_is_refused():
    bench = Bench()
    for place in (4, 8, 12):
        bench.send(place, place)
    with pytest.raises(OutOfRange, match=r"m/s from the last setpoint, 0\.5 m/s are allowed; nothing was sent"):
        bench.send(16, 16, 30)
    assert len(bench.sent) == 3


def test_a_leap_after_a_long_silence_is_refused_as_well():
    bench = Bench()
    bench.send(4, 4)
    bench.send(104, 104, 44)
    with pytest.raises(OutOfRange):
        bench.send(108, 108, 60)


def test_where_nobody_says_its_place_the_clock_does():
    bench = Bench()
    bench.send(4, 4)
    bench.now = 8 * MS
    with pytest.raises(OutOfRange):
        bench.setpoints.send(SPEED * 0.03, 0.0, TRAVEL, SAMPLES)
    bench.now = 28 * MS
    bench.setpoints.send(SPEED * 0.03, 0.0, TRAVEL, SAMPLES)
    assert len(bench.sent) == 2


def test_the_heartbeat_goes_with_setpoints_that_come_in_time_alone():
    bench = Bench()
    for place in range(4, 200, 4):
        bench.send(place, place)
    punctual = bench.beats
    for k in range(10):
        bench.send(220 + 24 * k, 196)
    assert punctual > 0
    assert bench.beats == punctual
