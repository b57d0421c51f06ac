"""A bus inside this process: frames in order, and a dead bus that says so."""

import itertools
import subprocess
import sys
import threading

import can
import pytest

from drivers.can_bus import CanAddress, CanBus, unpack_frame
from drivers.errors import BadReply, NotConnected

WITHIN = 5.0


@pytest.fixture
def pair(request):
    ticks = itertools.count()
    buses = [CanBus(CanAddress("virtual", request.node.name), lambda: next(ticks)) for _ in range(2)]
    for bus in buses:
        bus.open()
    yield buses
    for bus in buses:
        bus.close()


def test_frames_pass_and_the_tap_sees_both_directions_in_order(pair):
    one, other = pair
    frames, came = [], threading.Event()
    one.listen(frames.append)
    one.subscribe(lambda now, identifier, data: came.set())
    other.subscribe(lambda now, identifier, data: other.send(0x100, data))
    one.send(0x205, b"\x01\x02")
    assert came.wait(WITHIN)
    assert [(frame.sent, *unpack_frame(frame.data)) for frame in frames] == [
        (True, 0x205, b"\x01\x02"),
        (False, 0x100, b"\x01\x02"),
    ]
    assert frames[0].received_ns < frames[1].received_ns


def test_frames_sent_together_keep_their_order_and_their_moment(pair):
    one, other = pair
    heard, both = [], threading.Event()
    shown = []

    def hear(now: int, identifier: int, data: bytes) -> None:
        heard.append((identifier, data))
        if len(heard) == 2:
            both.set()

    other.subscribe(hear)
    one.listen(shown.append)
    one.send_together((0x205, b"\x01"), (0x80, b""))
    assert both.wait(WITHIN)
    assert heard == [(0x205, b"\x01"), (0x80, b"")]
    assert shown[0].received_ns == shown[1].received_ns


def test_listener_that_cannot_read_a_frame_is_counted_and_the_next_is_heard(pair):
    one, other = pair
    came = threading.Event()

    def heard(now: int, identifier: int, data: bytes) -> None:
        if not data:
            raise BadReply("nothing in it")
        came.set()

    other.subscribe(heard)
    one.send(0x181, b"")
    one.send(0x181, b"\x01")
    assert came.wait(WITHIN)
    assert other.corrupted == 1
    other.unsubscribe(heard)


def test_error_while_receiving_ends_in_not_connected(pair, monkeypatch):
    one, other = pair
    ended = threading.Event()

    def broken(timeout):
        ended.set()
        raise can.CanOperationError("cable pulled")

    monkeypatch.setattr(other._bus, "recv", broken)
    one.send(0x181, b"\x01")
    assert ended.wait(WITHIN)
    other._thread.join(WITHIN)
    with pytest.raises(NotConnected, match="cable pulled; connect again"):
        other.send(0x181, b"")
    assert not other.is_open


def test_error_while_sending_is_not_connected(pair, monkeypatch):
    one, _ = pair

    def full(message, timeout):
        raise can.CanOperationError("buffer full")

    monkeypatch.setattr(one._bus, "send", full)
    with pytest.raises(NotConnected, match="buffer full"):
        one.send(0x181, b"")


def test_bus_that_has_gone_is_closed_all_the_same(pair, monkeypatch):
    one, _ = pair

    def gone():
        raise OSError("no such device")

    monkeypatch.setattr(one._bus, "shutdown", gone)
    one.close()
    assert not one.is_open


def test_bus_that_is_not_open_or_not_there_is_not_connected():
    bus = CanBus(CanAddress("virtual", "nowhere"), lambda: 0)
    with pytest.raises(NotConnected, match="connect first"):
        bus.send(0x181, b"")
    with pytest.raises(NotConnected, match=r"CAN bus can9 \(socketcan\): cannot be opened"):
        CanBus(CanAddress("socketcan", "can9"), lambda: 0).open()


def test_whoever_takes_waiting_frames_hears_them_on_its_own_thread(pair):
    one, other = pair
    heard_on = []
    other.subscribe(lambda now, identifier, data: heard_on.append(threading.current_thread()))
    other.take_waiting()
    one.send(0x181, b"\x01")
    other.take_waiting()
    assert heard_on == [threading.current_thread()]


def test_while_somebody_waits_for_an_answer_frames_are_taken_by_the_bus_itself(pair):
    one, other = pair
    came = threading.Event()
    other.subscribe(lambda now, identifier, data: came.set())
    with other.at_once():
        one.send(0x181, b"\x01")
        assert came.wait(WITHIN)


def test_error_while_taking_is_told_to_whoever_takes(pair, monkeypatch):
    _, other = pair

    def broken(timeout):
        raise can.CanOperationError("cable pulled")

    monkeypatch.setattr(other._bus, "recv", broken)
    with pytest.raises(NotConnected, match="cable pulled"):
        other.take_waiting()


def test_what_the_library_would_say_on_standard_error_is_not_said():
    words = "import logging, drivers.can_bus; logging.getLogger('can.interfaces.socketcand').warning('incomplete')"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
