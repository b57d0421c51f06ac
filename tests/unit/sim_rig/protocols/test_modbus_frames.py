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
