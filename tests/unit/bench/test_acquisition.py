"""The threads around instruments, with instruments that do as they are told."""

import queue
import threading
import time

import numpy as np
import pytest

from bench.rig import acquisition
from bench.rig.acquisition import Acquisition
from drivers.channel import Block, Stamp
from drivers.errors import DriverError, NoReply

MS = 1_000_000
WITHIN = 10.0


class Scripted:
    """Gives what stands in its script, one entry a turn: blocks, or an error to raise; then nothing more."""

    def __init__(self, *script, connects=()):
        self.script, self.connects = queue.SimpleQueue(), list(connects)
        self.calls, self.stamp = [], None
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

    def sample(self):
        self.calls.append("sample")


def block(*values, device_ns=None):
    times = None if device_ns is None else np.array(device_ns)
    return Block("force", 0, times, 5 * MS, np.array(values), np.array(values), "good")


def eventually(found):
    deadline = time.monotonic() + WITHIN
    while not found():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.001)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch):
    monkeypatch.setattr(acquisition, "FIRST_PAUSE", 0.001)
    monkeypatch.setattr(acquisition, "LONGEST_PAUSE", 0.002)


@pytest.fixture
def acquired():
    """Starts an acquisition around one instrument; what it brought, and what it told of failures."""
    made = []

    def start(instrument, **more):
        brought, failed = queue.SimpleQueue(), queue.SimpleQueue()
        one = Acquisition({"cell": instrument}, brought.put, lambda *told: failed.put(told), **more)
        made.append(one)
        return one, brought, failed

    yield start
    for one in made:
        one.stop()


def test_what_comes_goes_to_the_sink_under_its_instruments_name(acquired):
    one, brought, _ = acquired(Scripted([block(1.0)], [], [block(2.0)]))
    one.start()
    batches = [brought.get(timeout=WITHIN) for _ in range(2)]
    assert [(batch.instrument, batch.blocks[0].values[0]) for batch in batches] == [("cell", 1.0), ("cell", 2.0)]


def test_a_stamp_makes_the_clock_known_before_its_samples_are_handed_on(acquired):
    instrument = Scripted()
    instrument.stamp = Stamp(1000 * MS, 3 * MS, 4 * MS)
    one, brought, _ = acquired(instrument)
    instrument.script.put([block(1.0, device_ns=[1001 * MS])])
    one.start()
    brought.get(timeout=WITHIN)
    assert one.maps["cell"].known
    assert 4 * MS <= int(one.maps["cell"].bench_ns(1001 * MS)) <= 5 * MS


def test_an_instrument_that_fails_is_told_once_and_left_alone(acquired):
    instrument = Scripted(NoReply("cell: silent"), NoReply("cell: silent still"))
    one, _, failed = acquired(instrument)
    one.start()
    name, error = failed.get(timeout=WITHIN)
    assert (name, str(error)) == ("cell", "cell: silent")
    eventually(lambda: one.down == ("cell",))
    assert instrument.calls == []
    assert failed.empty()


def test_where_it_may_it_is_connected_again_until_it_answers(acquired):
    instrument = Scripted(NoReply("gone"), connects=[NoReply("not yet"), NoReply("not yet"), None])
    one, brought, _ = acquired(instrument)
    one.reconnect = True
    one.start()
    eventually(lambda: one.reconnected == {"cell": 1})
    assert instrument.calls == ["close", "connect"] * 3
    assert one.down == ()
    instrument.script.put([block(7.0)])
    assert brought.get(timeout=WITHIN).blocks[0].values[0] == 7.0


def test_a_defect_while_it_connects_does_not_end_the_thread(acquired):
    one, _, _ = acquired(Scripted(NoReply("gone"), connects=[ValueError("a defect"), None]))
    one.reconnect = True
    one.start()
    eventually(lambda: one.reconnected == {"cell": 1})


def test_a_defect_of_a_driver_is_told_like_a_failure(acquired):
    one, _, failed = acquired(Scripted(ZeroDivisionError("division by zero")))
    one.start()
    _, error = failed.get(timeout=WITHIN)
    assert isinstance(error, DriverError)
    assert "defect of the driver" in str(error)


def test_a_clock_begins_anew_with_its_instrument(acquired):
    instrument = Scripted([block(1.0)])
    instrument.stamp = Stamp(1000 * MS, 3 * MS, 4 * MS)
    one, brought, _ = acquired(instrument)
    one.reconnect = True
    one.start()
    brought.get(timeout=WITHIN)
    instrument.stamp = None
    instrument.script.put(NoReply("gone"))
    eventually(lambda: one.reconnected == {"cell": 1})
    assert not one.maps["cell"].known


def test_while_nobody_leads_it_is_asked_for_samples(acquired):
    drive = Scripted()
    one, _, _ = acquired(drive, idle={"cell": drive})
    one.start()
    eventually(lambda: drive.calls.count("sample") >= 2)


def test_while_somebody_leads_it_is_not(acquired):
    drive = Scripted([block(1.0)])
    one, brought, _ = acquired(drive, idle={"cell": drive})
    one.led = True
    one.start()
    brought.get(timeout=WITHIN)
    assert drive.calls == []


def test_wires_that_hang_are_named(acquired):
    entered, free = threading.Event(), threading.Event()

    class Hanging(Scripted):
        def acquire(self, timeout):
            entered.set()
            free.wait(WITHIN)
            return []

    one, _, _ = acquired(Hanging())
    one.start()
    assert entered.wait(WITHIN)
    assert one.stop(within=0.01) == ("cell",)
    free.set()
    assert one.stop() == ()


def test_what_the_system_did_not_grant_is_said_once(acquired):
    one, _, _ = acquired(Scripted())
    for wire in ("a", "b"):
        one.warn(wire, "no real-time priority")
    one.warn("c", "")
    assert one.warnings == ("no real-time priority",)
