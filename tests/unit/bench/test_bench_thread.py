"""The thread that brings samples together, where something in it is broken."""

import threading
from types import MappingProxyType

from bench.agent.bench_thread import BenchThread

WITHIN = 10.0


class Broken:
    """An aligner that cannot align."""

    lost = MappingProxyType({})

    def ready(self):
        raise ZeroDivisionError("division by zero")


def test_a_defect_ends_the_run_and_not_the_watch():
    told, turns, again = [], [], threading.Event()

    def beat():
        turns.append(None)
        if len(turns) == 3:
            again.set()

    with BenchThread(Broken(), 1000.0, lambda samples: None, beat, told.append):
        assert again.wait(WITHIN)
    assert len(told) == 1
    assert "ZeroDivisionError" in str(told[0])


def test_a_beat_that_fails_is_told_and_comes_again():
    told, turns, again = [], [], threading.Event()

    def beat():
        turns.append(None)
        if len(turns) == 3:
            again.set()
        raise KeyError("segment")

    class Idle:
        lost = MappingProxyType({})

        def ready(self):
            return None

    with BenchThread(Idle(), 1000.0, lambda samples: None, beat, told.append):
        assert again.wait(WITHIN)
    assert len(told) == 1
    assert "segment" in str(told[0])
