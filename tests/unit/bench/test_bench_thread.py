"""The thread that brings samples together, where something in it is broken."""

import threading
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from bench.agent.bench_thread import BenchThread
from bench.errors import LogError

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


def test_live_samples_say_in_which_segment_they_are():
    told = []
    bench = BenchThread(Idle(), 1000.0, told.append, no_defect, told.append)
    for recording in (SimpleNamespace(segment="5mm_3Hz", end=no_defect), None):
        bench._recording = recording
        bench._live.append((SimpleNamespace(time_ns=np.arange(4)), {"force": np.ones(4)}))
        bench._published = 0.0
        bench._send_live()
    assert [(samples.segment, samples.values) for samples in told] == [
        ("5mm_3Hz", {"force": [1.0]}),
        ("", {"force": [1.0]}),
    ]


class Full:
    """A recording whose disk is full."""

    def take(self, aligned):
        raise LogError("a.mcap: no space left on device")


class Ready(Idle):
    """One sample, again and again."""

    def ready(self):
        return SimpleNamespace(time_ns=np.arange(1), columns={"force": np.ones(1)})


def test_whoever_is_told_of_a_full_disk_may_ask_what_was_lost():
    """The agent ends the run then, and a status asked for at the same moment counts the losses."""
    told = []
    bench = BenchThread(
        Ready(), 1000.0, told.append, no_defect, lambda error: told.append((str(error), bench.lost()))
    )
    bench.record(Full())
    turn = threading.Thread(target=bench._turn, daemon=True)
    turn.start()
    turn.join(WITHIN / 5)
    assert told == [("a.mcap: no space left on device", {})]
