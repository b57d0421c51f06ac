"""Replies with a block of samples in recorded frames, on TCP and on a serial line."""

import struct

import pytest

from drivers.channel import Frame
from drivers.replay.modbus_replies import ModbusReplyDecoder

READ, READ_WRITE = 4, 23
STATE = {"boot": 3, "origin": 100, "device_us": 0, "wanted": 100, "status": 0}
BLOCK = struct.pack(">HIIIIHH", 3, 100, 5_000, 9_000, 100, 1, 0) + struct.pack(">i", 70_000) + bytes(224)


def compute_crc(data):
    """Return the two bytes of the Modbus CRC-16 by the reflected polynomial A001h."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return struct.pack("<H", crc)


def make_request(rtu, function=READ, address=100, length=125, transaction=7, unit=1):
    body = struct.pack(">BBHH", unit, function, address, length)
    return body + compute_crc(body) if rtu else struct.pack(">HHH", transaction, 0, len(body)) + body


def make_reply(rtu, function=READ, block=BLOCK, transaction=7, unit=1):
    body = struct.pack(">BBB", unit, function, len(block)) + block
    return body + compute_crc(body) if rtu else struct.pack(">HHH", transaction, 0, len(body)) + body


def decode(rtu, *frames):
    """Return the samples of sent and received frames in turn."""
    decoder = ModbusReplyDecoder({"instrument": "lvdt", "rtu": rtu, "state": STATE})
    blocks = [decoder.feed(Frame(k, k % 2 == 0, data)) for k, data in enumerate(frames)]
    return [value for some in blocks for block in some for value in block.values.tolist()]


def test_the_block_has_the_length_of_the_wire_file():
    assert len(BLOCK) == 250
    assert compute_crc(b"123456789") == struct.pack("<H", 0x4B37)  # check value of CRC-16/MODBUS


@pytest.mark.parametrize("rtu", [False, True])
@pytest.mark.parametrize("function", [READ, READ_WRITE])
def test_a_requested_block_is_decoded(rtu, function):
    frames = make_request(rtu, function), make_reply(rtu, function)
    assert decode(rtu, *frames) == [pytest.approx(7e-3)]


@pytest.mark.parametrize("rtu", [False, True])
@pytest.mark.parametrize(
    "request_", [{"address": 101}, {"length": 124}, {"function": 3}, {"function": READ_WRITE}], ids=str
)
def test_the_reply_to_another_request_is_skipped(rtu, request_):
    assert decode(rtu, make_request(rtu, **request_), make_reply(rtu)) == []


@pytest.mark.parametrize("rtu", [False, True])
def test_an_incomplete_or_refused_block_is_skipped(rtu):
    request = make_request(rtu)
    assert decode(rtu, request, make_reply(rtu)[:-1]) == []
    assert decode(rtu, request, make_reply(rtu, block=BLOCK[:-2])) == []
    assert decode(rtu, request, make_reply(rtu, block=b"\0\4" + BLOCK[2:])) == []  # after a restart


def test_only_the_first_reply_to_a_request_counts():
    request, reply = make_request(rtu=False), make_reply(rtu=False)
    decoder = ModbusReplyDecoder({"instrument": "lvdt", "rtu": False, "state": STATE})
    decoder.feed(Frame(0, True, request))
    assert len(decoder.feed(Frame(1, False, reply))) == 1
    assert decoder.feed(Frame(2, False, reply)) == []


def test_the_reply_of_another_transaction_is_skipped():
    assert decode(False, make_request(rtu=False), make_reply(rtu=False, transaction=8)) == []


def test_noise_before_a_serial_reply_is_ignored_but_not_a_wrong_unit_or_checksum():
    request, reply = make_request(rtu=True), make_reply(rtu=True)
    assert len(decode(True, request, b"\x55\xaa" + reply)) == 1
    assert decode(True, request, make_reply(rtu=True, unit=2)) == []
    assert decode(True, request, reply[:-1] + bytes([reply[-1] ^ 1])) == []
