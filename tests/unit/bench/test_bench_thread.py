"""The thread that brings samples together, where something in it is broken."""

import threading
from types import MappingProxyType

import pytest

from bench.agent.bench_thread import BenchThread

WITHIN = 10.0


class Idle:
    """An aligner to which nothing has come."""

    lost = MappingProxyType({})

    def ready(self):
        return None


class Broken(Idle):
    """One that cannot align."""

    def ready(self):
        raise ZeroDivisionError("division by zero")


def no_defect():
    pass


def a_defect():
    raise KeyError("segment")


@pytest.mark.parametrize(
    ("aligner", "look", "words"), [(Broken(), no_defect, "ZeroDivisionError"), (Idle(), a_defect, "segment")]
)
def test_a_defect_ends_the_run_and_not_the_watch(aligner, look, words):
    told, turns, again = [], [], threading.Event()

    def beat():
        turns.append(None)
        if len(turns) == 3:
            again.set()
        look()

    with BenchThread(aligner, 1000.0, lambda samples: None, beat, told.append):
        assert again.wait(WITHIN)
    assert len(told) == 1
    assert words in str(told[0])
