"""A step before a run that ends in a way nobody foresaw."""

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


def test_ending_brings_a_step_to_rest_and_waits_for_it():
    def move(target, ending):
        assert ending.wait(10)

    rig = SimpleNamespace(actuator=SimpleNamespace(read=lambda channel: SimpleNamespace(value=0.0123)))
    over = []
    steps = Preparation(rig, move, lambda *said: None, lambda: over.append(None))
    assert steps.begin("move", 0.02).outcome == "going"
    steps.end(10)
    assert len(over) == 1
    assert steps.status.outcome == "done"
    assert "12.300 mm" in steps.status.words
