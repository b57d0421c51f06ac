"""Recording thread whose parts fail."""

import threading
import time
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from bench.errors import LogError
from bench.live import BatchMaker
from bench.recorder.recording_thread import RecordingThread

TIMEOUT = 10.0
MAKER = BatchMaker({"force": "N"})


def read_clock():
    """Bench clock of the tests, 2.5 s after the first sample [ns]."""
    return 2_500_000_000


class IdleAligner:
    """Aligner to which no samples came."""

    lost = MappingProxyType({})

    def align(self):
        return None


class BrokenAligner(IdleAligner):
    """Aligner with an internal error."""

    def align(self):
        raise ZeroDivisionError("division by zero")


def succeed():
    pass


def fail():
    raise KeyError("segment")


@pytest.mark.parametrize(
    ("aligner", "on_cycle", "message"),
    [(BrokenAligner(), succeed, "ZeroDivisionError"), (IdleAligner(), fail, "segment")],
)
def test_internal_error_ends_the_run_but_not_the_thread(aligner, on_cycle, message):
    failures, cycles, later = [], [], threading.Event()

    def run_cycle():
        cycles.append(None)
        if len(cycles) == 3:
            later.set()
        on_cycle()

    with RecordingThread(aligner, MAKER, read_clock, lambda samples: None, run_cycle, failures.append):
        assert later.wait(TIMEOUT)
    assert len(failures) == 1
    assert message in str(failures[0])


def test_live_batches_have_all_samples_with_the_utc_at_which_they_were_taken():
    published = []
    thread = RecordingThread(IdleAligner(), MAKER, read_clock, published.append, succeed, published.append)
    time_ns = np.arange(0, 1_000_000_000, 10_000_000)
    thread._live.append((SimpleNamespace(time_ns=time_ns), {"force": np.ones(100)}))
    before = time.time()
    thread._publish_live()
    assert [(batch.count, batch.period_s, batch.channels) for batch in published] == [
        (100, pytest.approx(0.01), (("force", "N"),))
    ]
    assert before - 2.5 - 1e-6 <= published[0].utc_s <= time.time() - 2.5
    assert thread._live == []


class FullDiskRecording:
    """Recording whose disk is full."""

    def add_samples(self, aligned):
        raise LogError("a.mcap: no space left on device")


class ReadyAligner(IdleAligner):
    """Aligner that returns one sample in every turn."""

    def align(self):
        return SimpleNamespace(time_ns=np.arange(1), columns={"force": np.ones(1)})


def test_receiver_of_a_full_disk_can_count_the_lost_samples():
    """The agent stops the run, and a status that is requested at the same time counts the losses."""
    failures = []
    thread = RecordingThread(
        ReadyAligner(),
        MAKER,
        read_clock,
        lambda samples: None,
        succeed,
        lambda error: failures.append((str(error), thread.count_lost())),
    )
    thread.start_recording(FullDiskRecording())
    turn = threading.Thread(target=thread._process_samples, daemon=True)
    turn.start()
    turn.join(TIMEOUT / 5)
    assert failures == [("a.mcap: no space left on device", {})]


def test_only_losses_during_the_recording_are_counted():
    aligner = IdleAligner()
    aligner.lost = {"force": 5}
    thread = RecordingThread(aligner, MAKER, read_clock, lambda samples: None, succeed, lambda error: None)
    thread.start_recording(SimpleNamespace(finish=succeed))
    aligner.lost = {"force": 7, "temperature": 1}
    assert thread.count_lost() == {"force": 2, "temperature": 1}
    assert thread.finish_recording() == {"force": 2, "temperature": 1}
