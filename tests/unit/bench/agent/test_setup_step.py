"""Setup steps on doubles of the actuator: their results, stops and limits."""

import threading
from types import SimpleNamespace

import pytest

from bench.agent.setup_step import SetupExecutor
from bench.errors import InterlockError
from bench.safety.interlocks import Interlocks
from bench.safety.limits import Action
from drivers.errors import RefusedError
from tests.support.fake_rig import EventLog, FakeActuator

TIMEOUT = 10.0
LIMITS = {"displacement": {Action.TRIP: 0.05}, "force_age": {Action.TRIP: 0.1}}


class Setup:
    """A setup executor with doubles of everything around it."""

    def __init__(self, actuator=None, move=lambda target, stop_requested: None):
        self.interlocks, self.events, self.end_count = Interlocks(LIMITS, "coil_voltage"), EventLog(), 0
        rig = SimpleNamespace(actuator=actuator or FakeActuator())
        self.executor = SetupExecutor(rig, self.interlocks, lambda: 0, move, self.events, self.count_end)

    def count_end(self):
        self.end_count += 1

    def is_permitted(self, position):
        try:
            self.interlocks.permit(position=position)
        except InterlockError:
            return False
        return True


def raising(error):
    def fail(*_):
        raise error

    return fail


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (RefusedError("the rod is not referenced"), "not referenced"),
        (KeyError("origin"), "mount failed: KeyError"),
    ],
)
def test_failed_step_is_reported_and_ends(error, message):
    setup = Setup(SimpleNamespace(mount=raising(error)))
    status = setup.executor.start("mount")
    assert status.outcome == "failed"
    assert message in status.message
    assert setup.events.list_texts("alarm") == [status.message]
    assert setup.end_count == 1


def test_stop_ends_a_move():
    actuator = FakeActuator()
    actuator.positions = [0.0123]
    setup = Setup(actuator, lambda target, stop_requested: stop_requested.wait(TIMEOUT))
    assert setup.executor.start("move", 0.02).outcome == "running"
    assert setup.executor.is_moving
    setup.executor.stop("enough")
    setup.executor.wait(TIMEOUT)
    assert not setup.executor.is_running
    assert setup.executor.status.outcome == "done"
    assert "12.300 mm" in setup.executor.status.message


def test_stop_of_homing_asks_the_drive_without_waiting_for_its_reply():
    safe, free = threading.Event(), threading.Event()

    def home():
        assert safe.wait(TIMEOUT)
        raise RefusedError("homing was stopped")

    def make_safe():
        assert free.wait(TIMEOUT)
        safe.set()

    setup = Setup(SimpleNamespace(home=home, make_safe=make_safe))
    setup.executor.start("home")
    setup.executor.stop("force 812 N exceeds the limit of 800 N")
    setup.executor.stop("another reason")
    free.set()
    setup.executor.wait(TIMEOUT)
    assert setup.executor.status.message == "force 812 N exceeds the limit of 800 N: homing was stopped"


def test_step_without_motion_is_not_stopped():
    free = threading.Event()
    setup = Setup(SimpleNamespace(mount=lambda: free.wait(TIMEOUT)))
    setup.executor.start("mount")
    assert setup.executor.is_running
    assert not setup.executor.is_moving
    setup.executor.stop("enough")
    free.set()
    setup.executor.wait(TIMEOUT)
    assert setup.executor.status.outcome == "done"


@pytest.mark.parametrize("error", [None, RefusedError("homing was stopped"), KeyError("defect")])
def test_homing_ignores_the_displacement_limit_only_while_it_lasts(error):
    permitted, ages = [], []

    def home():
        permitted.append(setup.is_permitted(0.06))
        ages.append(setup.interlocks.compute_force_age(10**9))
        if error is not None:
            raise error

    actuator = FakeActuator()
    actuator.home = home
    setup = Setup(actuator)
    setup.executor.start("home")
    assert (permitted, ages) == ([True], [1.0])
    assert not setup.is_permitted(0.06)
    assert setup.interlocks.compute_force_age(10**9) == 0.0


def test_move_keeps_the_displacement_limit():
    permitted = []
    setup = Setup(move=lambda target, stop_requested: permitted.append(setup.is_permitted(0.06)))
    setup.executor.start("move", 0.01)
    assert permitted == [False]
