"""A step before a run that ends in a way nobody foresaw."""

import threading
from types import SimpleNamespace

import pytest

from bench.agent.preparation import Preparation
from drivers.errors import Refused


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (Refused("the rod does not know where it is"), "does not know"),
        (KeyError("origin"), "mount ended: KeyError"),
    ],
)
def test_a_step_that_fails_says_so_and_is_over(error, words):
    def mount():
        raise error

    told, over = [], []
    rig = SimpleNamespace(actuator=SimpleNamespace(mount=mount))
    steps = Preparation(
        rig, lambda target, ending: None, lambda *said: told.append(said), lambda: over.append(None)
    )
    status = steps.begin("mount")
    assert status.outcome == "failed"
    assert words in status.words
    assert ("alarm", status.words) in told
    assert len(over) == 1


AT_12_MM = SimpleNamespace(read=lambda channel: SimpleNamespace(value=0.0123))


def steps_of(rod, move):
    return Preparation(SimpleNamespace(actuator=rod), move, lambda *said: None, lambda: None)


def test_a_stop_brings_a_move_to_rest():
    steps = steps_of(AT_12_MM, lambda target, ending: ending.wait(10))
    assert steps.begin("move", 0.02).outcome == "going"
    assert steps.moving
    steps.stop("enough")
    steps.wait(10)
    assert not steps.going
    assert steps.status.outcome == "done"
    assert "12.300 mm" in steps.status.words


def test_a_search_for_the_reference_is_stopped_by_the_drive_and_says_why():
    """Nobody who asks for the stop waits for the drive's answer."""
    safe, free = threading.Event(), threading.Event()

    def home():
        assert safe.wait(10)
        raise Refused("homing was broken off")

    def make_safe():
        assert free.wait(10)
        safe.set()

    steps = steps_of(SimpleNamespace(home=home, make_safe=make_safe), lambda target, ending: None)
    steps.begin("home")
    steps.stop("force 812 N exceeds the limit of 800 N")
    steps.stop("another reason")
    free.set()
    steps.wait(10)
    assert steps.status.words == "force 812 N exceeds the limit of 800 N: homing was broken off"


def test_a_step_in_which_nothing_moves_is_not_stopped():
    let = threading.Event()
    steps = steps_of(SimpleNamespace(mount=lambda: let.wait(10)), lambda target, ending: None)
    steps.begin("mount")
    assert steps.going
    assert not steps.moving
    steps.stop("enough")
    let.set()
    steps.wait(10)
    assert steps.status.outcome == "done"
