"""A bus inside this process: frames in order, and errors of a dead bus."""

import itertools
import subprocess
import sys
import threading

import can
import pytest

from drivers.errors import InvalidReplyError, NotConnectedError
from drivers.transport.can_bus import CanAddress, CanBus, unpack_frame

TIMEOUT = 5.0


@pytest.fixture
def pair(request):
    ticks = itertools.count()
    buses = [CanBus(CanAddress("virtual", request.node.name), lambda: next(ticks)) for _ in range(2)]
    for bus in buses:
        bus.open()
    yield buses
    for bus in buses:
        bus.close()


def test_frames_pass_and_a_listener_gets_both_directions_in_order(pair):
    one, other = pair
    frames, received = [], threading.Event()
    one.add_listener(frames.append)
    one.subscribe(lambda now, identifier, data: received.set())
    other.subscribe(lambda now, identifier, data: other.send(0x100, data))
    one.send(0x205, b"\x01\x02")
    assert received.wait(TIMEOUT)
    assert [(frame.sent, *unpack_frame(frame.data)) for frame in frames] == [
        (True, 0x205, b"\x01\x02"),
        (False, 0x100, b"\x01\x02"),
    ]
    assert frames[0].received_ns < frames[1].received_ns


def test_a_batch_keeps_its_order_and_has_one_time(pair):
    one, other = pair
    received, complete = [], threading.Event()
    sent = []

    def handle(now: int, identifier: int, data: bytes) -> None:
        received.append((identifier, data))
        if len(received) == 2:
            complete.set()

    other.subscribe(handle)
    one.add_listener(sent.append)
    one.send_batch((0x205, b"\x01"), (0x80, b""))
    assert complete.wait(TIMEOUT)
    assert received == [(0x205, b"\x01"), (0x80, b"")]
    assert sent[0].received_ns == sent[1].received_ns


def test_a_frame_that_cannot_be_decoded_is_counted_and_the_next_is_handled(pair):
    one, other = pair
    received = threading.Event()

    def handle(now: int, identifier: int, data: bytes) -> None:
        if not data:
            raise InvalidReplyError("empty")
        received.set()

    other.subscribe(handle)
    one.send(0x181, b"")
    one.send(0x181, b"\x01")
    assert received.wait(TIMEOUT)
    assert other.corrupted == 1
    other.unsubscribe(handle)


def test_error_while_receiving_ends_in_not_connected(pair, monkeypatch):
    one, other = pair
    ended = threading.Event()

    def broken(timeout):
        ended.set()
        raise can.CanOperationError("cable pulled")

    monkeypatch.setattr(other._bus, "recv", broken)
    one.send(0x181, b"\x01")
    assert ended.wait(TIMEOUT)
    other._thread.join(TIMEOUT)
    with pytest.raises(NotConnectedError, match="cable pulled; connect again"):
        other.send(0x181, b"")
    assert not other.is_open


def test_error_while_sending_is_not_connected(pair, monkeypatch):
    one, _ = pair

    def full(message, timeout):
        raise can.CanOperationError("buffer full")

    monkeypatch.setattr(one._bus, "send", full)
    with pytest.raises(NotConnectedError, match="buffer full"):
        one.send(0x181, b"")


def test_a_bus_that_is_gone_is_closed(pair, monkeypatch):
    one, _ = pair

    def fail():
        raise OSError("no such device")

    monkeypatch.setattr(one._bus, "shutdown", fail)
    one.close()
    assert not one.is_open


def test_bus_that_is_not_open_or_not_there_is_not_connected():
    bus = CanBus(CanAddress("virtual", "nowhere"), lambda: 0)
    with pytest.raises(NotConnectedError, match="connect first"):
        bus.send(0x181, b"")
    with pytest.raises(NotConnectedError, match=r"CAN bus can9 \(socketcan\): cannot be opened"):
        CanBus(CanAddress("socketcan", "can9"), lambda: 0).open()


def test_drained_frames_are_handled_on_the_calling_thread(pair):
    one, other = pair
    threads = []
    other.subscribe(lambda now, identifier, data: threads.append(threading.current_thread()))
    other.drain()
    one.send(0x181, b"\x01")
    other.drain()
    assert threads == [threading.current_thread()]


def test_with_immediate_reception_the_bus_thread_handles_frames(pair):
    one, other = pair
    received = threading.Event()
    other.subscribe(lambda now, identifier, data: received.set())
    with other.receive_immediately():
        one.send(0x181, b"\x01")
        assert received.wait(TIMEOUT)


def test_an_error_while_draining_is_raised(pair, monkeypatch):
    _, other = pair

    def broken(timeout):
        raise can.CanOperationError("cable pulled")

    monkeypatch.setattr(other._bus, "recv", broken)
    with pytest.raises(NotConnectedError, match="cable pulled"):
        other.drain()


def test_the_library_writes_nothing_to_standard_error():
    code = "import logging, drivers.transport.can_bus\n"
    code += "logging.getLogger('can.interfaces.socketcand').warning('incomplete')"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (result.returncode, result.stderr) == (0, "")
