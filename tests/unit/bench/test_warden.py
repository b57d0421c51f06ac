from types import SimpleNamespace

import numpy as np
import pytest

from bench.agent.warden import Warden
from bench.rig.acquisition import Batch
from bench.rig.clock_map import ClockMap
from drivers.channel import Block, Stamp

MS = 1_000_000


class Lenient:
    """Interlocks that find nothing, and remember what they were asked."""

    def __init__(self):
        self.asked = {}

    def check(self, blocks, now_ns):
        return []

    def check_value(self, what, value, now_ns):
        self.asked[what] = value
        return []


@pytest.fixture
def told():
    return []


@pytest.fixture
def warden(told):
    rig = SimpleNamespace(actuator=SimpleNamespace(name="actuator", settings=SimpleNamespace(cycle=0.004)))
    told_to = lambda *words: told.append(words)  # noqa: E731
    return Warden(rig, Lenient(), lambda: 0, {"actuator": ClockMap()}, told_to, lambda why, hold: None)


def test_a_setpoint_that_left_too_late_for_the_drive_stands_in_the_log(warden, told):
    warden.late(0, 0.0123)
    assert told == [("late", "a setpoint left 12.3 ms late")]


def test_what_a_drive_bridges_does_not(warden, told):
    warden.late(0, 0.0079)
    assert told == []


def read_late(device_ns):
    """Two samples of a rod at 1 m/s, exactly where it was sent, read 50 ms after the second was taken."""
    clock = None if device_ns is None else np.array(device_ns) * MS
    values = np.array([0.100, 0.104])
    return Batch("actuator", (Block("actuator_position", 0, clock, 154 * MS, values, values, "good"),))


def test_a_rod_is_not_astray_because_its_samples_were_read_late(warden):
    warden._maps["actuator"].feed(Stamp(1000 * MS, 0, 0))
    warden.plan = SimpleNamespace(position=lambda time_ns: time_ns * 1e-9)
    warden.look(read_late([1100, 1104]))
    assert warden._interlocks.asked["following_error"] == pytest.approx(0, abs=1e-6)


def test_without_a_clock_the_last_sample_counts_as_taken_when_it_came(warden):
    warden.plan = SimpleNamespace(position=lambda time_ns: time_ns * 1e-9)
    warden.look(read_late(None))
    assert warden._interlocks.asked["following_error"] == pytest.approx(-0.05)
