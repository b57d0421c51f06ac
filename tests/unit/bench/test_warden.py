from types import SimpleNamespace

import numpy as np
import pytest

from bench.agent.warden import Warden
from bench.rig.acquisition import Batch
from bench.rig.clock_map import ClockMap
from bench.safety.limits import Action, Verdict
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
    told_to = lambda *words, **more: told.append((*words, more))  # noqa: E731
    return Warden(rig, Lenient(), lambda: 0, {"actuator": ClockMap()}, told_to, lambda why, hold: None)


def test_a_setpoint_that_left_too_late_for_the_drive_stands_in_the_log(warden, told):
    warden.late(0, 0.0123)
    facts = {"quantity": "setpoint_lateness", "value": 0.0123}
    assert told == [("late", "a setpoint left 12.3 ms late", facts)]


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


def test_a_cycle_without_its_sample_does_not_make_the_others_astray(warden):
    """The second of three samples is lost: the two others lie further apart than a cycle."""
    warden.plan = SimpleNamespace(position=lambda time_ns: time_ns * 1e-9)
    parts = [
        Block("actuator_position", number, None, 112 * MS, np.array([place]), np.array([0.0]), "good")
        for number, place in ((7, 0.104), (9, 0.112))
    ]
    warden.look(Batch("actuator", tuple(parts)))
    assert warden._interlocks.asked["following_error"] == pytest.approx(0, abs=1e-9)


def test_an_alarm_says_what_was_judged_in_numbers_too(warden, told):
    verdict = Verdict("force", Action.INDICATE, 812.0, 800.0)
    warden._interlocks.check = lambda blocks, now_ns: [verdict]
    warden.tick()
    facts = {"quantity": "force", "value": 812.0, "limit": 800.0}
    assert told == [("alarm", "force 812 N exceeds the limit of 800 N", facts)]
