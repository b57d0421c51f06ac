"""Acquisition threads around instruments that follow a script."""

import queue
import threading
import time

import numpy as np
import pytest

from bench.rig.acquisition import Acquisition, RetryPauses
from drivers.channel import ClockReading, SampleBlock
from drivers.errors import DriverError, NoReplyError
from tests.support.waiting import wait_until

MS = 1_000_000
TIMEOUT = 10.0


class ScriptedInstrument:
    """Instrument that returns one entry of its script per turn: blocks, or an error to raise; then nothing."""

    def __init__(self, *script, connects=()):
        self.script, self.connects = queue.SimpleQueue(), list(connects)
        self.calls, self.clock_reading = [], None
        for entry in script:
            self.script.put(entry)

    def acquire(self, timeout):
        try:
            entry = self.script.get(timeout=min(timeout, 0.01))
        except queue.Empty:
            return []
        if isinstance(entry, Exception):
            raise entry
        return entry

    def close(self):
        self.calls.append("close")

    def connect(self):
        self.calls.append("connect")
        if self.connects and (error := self.connects.pop(0)) is not None:
            raise error

    def send_sync(self):
        self.calls.append("sync")


class ClocklessInstrument(ScriptedInstrument):
    """Instrument without a clock."""

    def __init__(self, *script):
        super().__init__(*script)
        del self.clock_reading


def block(*values, device_ns=None):
    times = None if device_ns is None else np.array(device_ns)
    return SampleBlock("force", 0, times, 5 * MS, np.array(values), np.array(values), "good")


@pytest.fixture
def acquire():
    """Return a function that makes an acquisition of one instrument, with queues of its batches and failures."""
    acquisitions = []

    def make(instrument, **more):
        batches, failures = queue.SimpleQueue(), queue.SimpleQueue()
        acquisition = Acquisition(
            {"cell": instrument},
            batches.put,
            lambda name, error: failures.put((name, error)),
            retry_pauses=RetryPauses(0.001, 0.002),
            **more,
        )
        acquisitions.append(acquisition)
        return acquisition, batches, failures

    yield make
    for acquisition in acquisitions:
        acquisition.stop()


def test_batches_carry_the_name_of_their_instrument(acquire):
    acquisition, batches, _ = acquire(ScriptedInstrument([block(1.0)], [], [block(2.0)]))
    acquisition.start()
    received = [batches.get(timeout=TIMEOUT) for _ in range(2)]
    assert [(batch.instrument, batch.blocks[0].values[0]) for batch in received] == [("cell", 1.0), ("cell", 2.0)]


def test_clock_is_known_before_the_samples_are_passed_on(acquire):
    instrument = ScriptedInstrument()
    instrument.clock_reading = ClockReading(1000 * MS, 3 * MS, 4 * MS)
    acquisition, batches, _ = acquire(instrument)
    instrument.script.put([block(1.0, device_ns=[1001 * MS])])
    acquisition.start()
    batches.get(timeout=TIMEOUT)
    assert acquisition.maps["cell"].is_known
    assert 4 * MS <= int(acquisition.maps["cell"].map_instants(1001 * MS)) <= 5 * MS


def test_instrument_without_a_clock_has_an_unknown_map(acquire):
    acquisition, batches, _ = acquire(ClocklessInstrument([block(1.0)]))
    acquisition.start()
    batches.get(timeout=TIMEOUT)
    assert not acquisition.maps["cell"].is_known


def test_failure_is_reported_once_and_the_instrument_left_alone(acquire):
    instrument = ScriptedInstrument(NoReplyError("cell: no reply"), NoReplyError("cell: still no reply"))
    acquisition, _, failures = acquire(instrument)
    acquisition.start()
    name, error = failures.get(timeout=TIMEOUT)
    assert (name, str(error)) == ("cell", "cell: no reply")
    wait_until(lambda: acquisition.failed_instruments == ("cell",))
    assert instrument.calls == []
    assert failures.empty()


def test_failed_instrument_is_connected_again_until_it_replies(acquire):
    errors = [NoReplyError("not yet"), NoReplyError("not yet"), None]
    instrument = ScriptedInstrument(NoReplyError("gone"), connects=errors)
    acquisition, batches, _ = acquire(instrument)
    acquisition.enable_reconnection()
    acquisition.start()
    wait_until(lambda: acquisition.reconnect_counts == {"cell": 1})
    assert instrument.calls == ["close", "connect"] * 3
    assert acquisition.failed_instruments == ()
    instrument.script.put([block(7.0)])
    assert batches.get(timeout=TIMEOUT).blocks[0].values[0] == 7.0


def test_suspended_reconnection_continues_after_the_block(acquire):
    instrument = ScriptedInstrument(NoReplyError("gone"))
    acquisition, _, failures = acquire(instrument)
    acquisition.enable_reconnection()
    with acquisition.suspend_reconnection():
        acquisition.start()
        failures.get(timeout=TIMEOUT)
        time.sleep(0.02)
        assert instrument.calls == []
    wait_until(lambda: acquisition.reconnect_counts == {"cell": 1})


def test_suspension_does_not_enable_reconnection_that_was_disabled(acquire):
    instrument = ScriptedInstrument(NoReplyError("gone"))
    acquisition, _, failures = acquire(instrument)
    with acquisition.suspend_reconnection():
        pass
    acquisition.start()
    failures.get(timeout=TIMEOUT)
    time.sleep(0.02)
    assert instrument.calls == []


def test_internal_error_while_connecting_does_not_end_the_thread(acquire):
    acquisition, _, _ = acquire(ScriptedInstrument(NoReplyError("gone"), connects=[ValueError("defect"), None]))
    acquisition.enable_reconnection()
    acquisition.start()
    wait_until(lambda: acquisition.reconnect_counts == {"cell": 1})


def test_internal_error_of_a_driver_is_reported_as_a_failure(acquire):
    acquisition, _, failures = acquire(ScriptedInstrument(ZeroDivisionError("division by zero")))
    acquisition.start()
    _, error = failures.get(timeout=TIMEOUT)
    assert isinstance(error, DriverError)
    assert "internal error of the driver" in str(error)


def test_clock_map_restarts_with_its_instrument(acquire):
    instrument = ScriptedInstrument([block(1.0)])
    instrument.clock_reading = ClockReading(1000 * MS, 3 * MS, 4 * MS)
    acquisition, batches, _ = acquire(instrument)
    acquisition.enable_reconnection()
    acquisition.start()
    batches.get(timeout=TIMEOUT)
    instrument.clock_reading = None
    instrument.script.put(NoReplyError("gone"))
    wait_until(lambda: acquisition.reconnect_counts == {"cell": 1})
    assert not acquisition.maps["cell"].is_known


def test_idle_drive_is_asked_for_samples(acquire):
    drive = ScriptedInstrument()
    acquisition, _, _ = acquire(drive, idle={"cell": drive})
    acquisition.start()
    wait_until(lambda: drive.calls.count("sync") >= 2)


def test_externally_triggered_drive_is_not_asked_for_samples(acquire):
    drive = ScriptedInstrument([block(1.0)])
    acquisition, batches, _ = acquire(drive, idle={"cell": drive})
    acquisition.set_externally_triggered(True)
    acquisition.start()
    batches.get(timeout=TIMEOUT)
    assert drive.calls == []
    acquisition.set_externally_triggered(False)
    wait_until(lambda: drive.calls)


def test_hanging_wires_are_named(acquire):
    entered, free = threading.Event(), threading.Event()

    class HangingInstrument(ScriptedInstrument):
        def acquire(self, timeout):
            entered.set()
            free.wait(TIMEOUT)
            return []

    acquisition, _, _ = acquire(HangingInstrument())
    acquisition.start()
    assert entered.wait(TIMEOUT)
    assert acquisition.stop(timeout=0.01) == ("cell",)
    free.set()
    assert acquisition.stop() == ()


def test_same_warning_of_several_threads_is_listed_once(monkeypatch):
    monkeypatch.setattr("bench.rig.acquisition.raise_priority", lambda: "no real-time priority")
    instruments = {name: ScriptedInstrument() for name in ("a", "b")}
    acquisition = Acquisition(instruments, lambda batch: None, lambda name, error: None)
    acquisition.start()
    acquisition.stop()
    assert acquisition.warnings == ("no real-time priority",)
