from types import SimpleNamespace

import pytest

from bench.agent.warden import Warden


class Lenient:
    """Interlocks that find nothing."""

    def check_value(self, what, value, now_ns):
        return ()


@pytest.fixture
def told():
    return []


@pytest.fixture
def warden(told):
    rig = SimpleNamespace(actuator=SimpleNamespace(settings=SimpleNamespace(cycle=0.004)))
    return Warden(rig, Lenient(), lambda: 0, lambda *words: told.append(words), lambda why, hold: None)


def test_a_setpoint_that_left_too_late_for_the_drive_stands_in_the_log(warden, told):
    warden.late(0, 0.0123)
    assert told == [("late", "a setpoint left 12.3 ms late")]


def test_what_a_drive_bridges_does_not(warden, told):
    warden.late(0, 0.0079)
    assert told == []
