"""The simulated Modbus side without any socket: frames, and the amplifier's output over time."""

import pytest

from sim_rig.coil_output import CoilOutput, Table
from sim_rig.modbus_frames import MBAP, RTU, Request, crc
from sim_rig.modbus_requests import answer

MS = 1_000_000


def test_the_checksum_is_that_of_modbus():
    assert crc(bytes.fromhex("01030000000a")) == bytes.fromhex("c5cd")


@pytest.mark.parametrize("framing", [MBAP, RTU])
def test_a_request_is_taken_only_when_it_is_whole(framing):
    request = Request(1, bytes.fromhex("040064007d"), 7 if framing is MBAP else 0)
    frame = framing.wrap(request)
    for cut in range(len(frame)):
        assert framing.take(frame[:cut]) == (None, frame[:cut])
    assert framing.take(frame + b"next") == (request, b"next")
    assert framing.take(framing.corrupt(frame)) == (None, b"")


def test_a_ramp_goes_to_its_target_and_no_further():
    output = CoilOutput(ramp=10.0)
    output.go(1.0, 0)
    assert [output.level(t * MS) for t in (0, 50, 100, 500)] == pytest.approx([0.0, 0.5, 1.0, 1.0])
    output.go(-1.0, 500 * MS)
    assert output.level(600 * MS) == pytest.approx(0.0)


def test_a_table_runs_by_the_clock_whoever_looks_and_however_late():
    steps = [(0, 0.5), (10 * MS, 1.0), (20 * MS, 0.0)]
    looked_at, left_alone = CoilOutput(), CoilOutput()
    for output in (looked_at, left_alone):
        output.arm(steps)
        output.trigger(100 * MS)
    seen = [looked_at.level(100 * MS + t) for t in (0, 10 * MS - 1, 10 * MS, 19 * MS, 20 * MS, 90 * MS)]
    assert seen == [0.5, 0.5, 1.0, 1.0, 0.0, 0.0]
    assert left_alone.level(115 * MS) == 1.0
    assert left_alone.level(190 * MS) == 0.0
    assert looked_at.table is left_alone.table is Table.DONE


def test_before_its_first_step_a_table_holds_what_was_there():
    output = CoilOutput(ramp=10.0)
    output.go(1.0, 0)
    output.arm([(50 * MS, 2.0), (60 * MS, 0.0)])
    output.trigger(50 * MS)
    assert output.level(99 * MS) == pytest.approx(0.5)
    assert output.level(100 * MS) == 2.0


def test_a_trigger_without_an_armed_table_does_nothing():
    output = CoilOutput()
    output.trigger(0)
    assert output.table is Table.IDLE
    assert output.level(MS) == 0.0


class Nothing:
    """A device whose registers are all zero."""

    def read(self, function, address, count):
        return [0] * count

    def write(self, address, words):
        pass


@pytest.mark.parametrize("request_", ["03", "0400", "0600010a", "10000100020401", "170001000200010001", "08"])
def test_a_request_that_ends_too_soon_is_refused_and_not_the_end_of_the_instrument(request_):
    pdu = bytes.fromhex(request_)
    assert answer(Nothing(), pdu)[0] == pdu[0] | 0x80


def test_a_request_that_writes_and_reads_does_both():
    pdu = bytes.fromhex("17 0004 0002 0001 0001 02 002a".replace(" ", ""))
    assert answer(Nothing(), pdu) == bytes.fromhex("170400000000")
