"""Simulated Modbus instrument without socket: frames, requests, and the amplifier's output over time."""

import pytest

from sim_rig.instruments.coil_output import CoilOutput, TableState
from sim_rig.protocols.modbus_frames import MBAP, RTU, ModbusRequest, compute_crc
from sim_rig.protocols.modbus_requests import handle_request

MS = 1_000_000


def test_the_checksum_is_that_of_modbus():
    assert compute_crc(bytes.fromhex("01030000000a")) == bytes.fromhex("c5cd")


@pytest.mark.parametrize("framing", [MBAP, RTU])
def test_a_request_is_extracted_only_when_complete(framing):
    request = ModbusRequest(1, bytes.fromhex("040064007d"), 7 if framing is MBAP else 0)
    frame = framing.encode(request)
    for cut in range(len(frame)):
        assert framing.extract(frame[:cut]) == (None, frame[:cut])
    assert framing.extract(frame + b"next") == (request, b"next")
    assert framing.extract(framing.corrupt(frame)) == (None, b"")


def test_a_ramp_ends_at_its_target():
    output = CoilOutput(ramp=10.0)
    output.set_target(1.0, 0)
    assert [output.compute_level(t * MS) for t in (0, 50, 100, 500)] == pytest.approx([0.0, 0.5, 1.0, 1.0])
    output.set_target(-1.0, 500 * MS)
    assert output.compute_level(600 * MS) == pytest.approx(0.0)


def test_a_table_runs_by_the_clock_even_if_evaluated_late():
    steps = [(0, 0.5), (10 * MS, 1.0), (20 * MS, 0.0)]
    polled, unpolled = CoilOutput(), CoilOutput()
    for output in (polled, unpolled):
        output.arm(steps)
        output.trigger(100 * MS)
    levels = [polled.compute_level(100 * MS + t) for t in (0, 10 * MS - 1, 10 * MS, 19 * MS, 20 * MS, 90 * MS)]
    assert levels == [0.5, 0.5, 1.0, 1.0, 0.0, 0.0]
    assert unpolled.compute_level(115 * MS) == 1.0
    assert unpolled.compute_level(190 * MS) == 0.0
    assert polled.table is unpolled.table is TableState.DONE


def test_a_table_holds_the_present_level_before_its_first_step():
    output = CoilOutput(ramp=10.0)
    output.set_target(1.0, 0)
    output.arm([(50 * MS, 2.0), (60 * MS, 0.0)])
    output.trigger(50 * MS)
    assert output.compute_level(99 * MS) == pytest.approx(0.5)
    assert output.compute_level(100 * MS) == 2.0


def test_a_trigger_without_an_armed_table_does_nothing():
    output = CoilOutput()
    output.trigger(0)
    assert output.table is TableState.IDLE
    assert output.compute_level(MS) == 0.0


class ZeroDevice:
    """A device whose registers are all zero."""

    def read(self, function, address, count):
        return [0] * count

    def write(self, address, words):
        pass


@pytest.mark.parametrize("request_", ["03", "0400", "0600010a", "10000100020401", "170001000200010001", "08"])
def test_a_truncated_request_is_refused(request_):
    pdu = bytes.fromhex(request_)
    assert handle_request(ZeroDevice(), pdu)[0] == pdu[0] | 0x80


def test_a_request_may_write_and_read():
    pdu = bytes.fromhex("17 0004 0002 0001 0001 02 002a".replace(" ", ""))
    assert handle_request(ZeroDevice(), pdu) == bytes.fromhex("170400000000")


class Recorder:
    """A device whose register k has the value k; it keeps what is written."""

    def __init__(self):
        self.written = []

    def read(self, function, address, count):
        return list(range(address, address + count))

    def write(self, address, words):
        self.written.append((address, words))


def words_of(*values):
    return b"".join(value.to_bytes(2, "big") for value in values)


@pytest.mark.parametrize("function", [3, 4])
@pytest.mark.parametrize(("count", "accepted"), [(0, False), (1, True), (125, True), (126, False)])
def test_up_to_125_registers_are_read(function, count, accepted):
    reply = handle_request(Recorder(), bytes([function]) + words_of(7, count))
    expected = bytes([function, 2 * count]) + words_of(*range(7, 7 + count)) if accepted else None
    assert reply == (expected or bytes([function | 0x80, 3]))


@pytest.mark.parametrize(("count", "size", "accepted"), [
    (1, 2, True), (123, 246, True), (124, 248, False), (0, 0, False), (2, 2, False), (1, 4, False),
])  # fmt: skip
def test_up_to_123_registers_are_written_if_their_size_agrees(count, size, accepted):
    device, values = Recorder(), words_of(*range(size // 2))
    reply = handle_request(device, bytes([16]) + words_of(7, count) + bytes([size]) + values)
    assert reply == (bytes([16]) + words_of(7, count) if accepted else bytes([0x90, 3]))
    assert device.written == ([(7, list(range(count)))] if accepted else [])


@pytest.mark.parametrize(("read", "write", "size", "accepted"), [
    (1, 1, 2, True), (125, 121, 242, True), (126, 1, 2, False), (1, 122, 244, False), (0, 1, 2, False),
    (1, 0, 0, False), (1, 1, 4, False), (1, 2, 2, False),
])  # fmt: skip
def test_registers_are_written_before_others_are_read(read, write, size, accepted):
    device, values = Recorder(), words_of(*range(size // 2))
    reply = handle_request(device, bytes([23]) + words_of(9, read, 4, write) + bytes([size]) + values)
    assert reply == (bytes([23, 2 * read]) + words_of(*range(9, 9 + read)) if accepted else bytes([0x97, 3]))
    assert device.written == ([(4, list(range(write)))] if accepted else [])


def test_one_register_is_written_query_data_is_returned_and_other_functions_are_refused():
    device = Recorder()
    assert handle_request(device, bytes([6]) + words_of(9, 500)) == bytes([6]) + words_of(9, 500)
    assert device.written == [(9, [500])]
    assert handle_request(device, bytes([8]) + words_of(0, 77)) == bytes([8]) + words_of(0, 77)
    assert handle_request(device, bytes([8]) + words_of(1, 77)) == bytes([0x88, 1])
    assert handle_request(device, bytes([5]) + words_of(1, 77)) == bytes([0x85, 1])


@pytest.mark.parametrize(("function", "body"), [
    (3, words_of(1, 2)),
    (6, words_of(1, 2)),
    (16, words_of(1, 2) + bytes([4]) + words_of(3, 4)),
    (23, words_of(1, 2, 3, 1) + bytes([2]) + words_of(5)),
])  # fmt: skip
def test_length_of_a_serial_request_follows_from_its_function(function, body):
    request = ModbusRequest(1, bytes([function]) + body)
    frame = RTU.encode(request)
    assert RTU.extract(frame + frame[:3]) == (request, frame[:3])
    assert RTU.extract(frame[:-1]) == (None, frame[:-1])


@pytest.mark.parametrize(
    ("protocol", "length", "kept"), [(0, 2, True), (0, 1, False), (0, 255, False), (1, 6, False)]
)
def test_network_frame_of_another_protocol_or_length_is_discarded(protocol, length, kept):
    frame = words_of(5, protocol, length) + bytes([1, 3, 0, 0])
    found = (ModbusRequest(1, bytes([3]), 5), b"\0\0") if kept else (None, b"")
    assert MBAP.extract(frame) == found
    assert MBAP.extract(words_of(5, 0, 254) + bytes(253)) == (None, words_of(5, 0, 254) + bytes(253))
    assert MBAP.extract(words_of(5, 0, 254) + bytes(254))[1] == b""
