"""Reading of the ring buffer over a double of the registers: start, catching up, failures, age."""

from types import SimpleNamespace

import pytest

from drivers.channel import ClockReading
from drivers.errors import InvalidReplyError, NoReplyError, NotConnectedError
from drivers.modbus.ring_buffer_reader import RingBufferReader
from drivers.transport.modbus_line import RegisterReply
from drivers.transport.modbus_registers import load_register_map

MS = 1_000_000


def split_words(number):
    return [number >> 16, number & 0xFFFF]


class Registers:
    """LVDT with samples up to a number; each request is answered by at most two samples, or by an error."""

    def __init__(self, newest, *errors, **identity):
        self.newest, self.errors, self.starts = newest, list(errors), []
        self.map, self.line = (
            load_register_map("lvdt"),
            SimpleNamespace(name="lvdt", connected=True, received=1, corrupted=1, resynchronised=0, last_ns=5),
        )
        self.group = {"identity": 0x4C56, "boot": 3, "interval": 1000, "newest": 99, "clock": 7_000} | identity

    def read_group(self, *names):
        return {name: SimpleNamespace(raw=self.group[name]) for name in names}, RegisterReply([], 10, 20)

    def write_and_read(self, name, first, address, count):
        self.starts.append((name, first, address, count))
        if self.errors and (error := self.errors.pop(0)):
            raise error
        size = min(max(self.newest + 1 - first, 0), 2)
        header = [3, *split_words(first), *split_words(8_000), *split_words(9_500), *split_words(self.newest)]
        words = [*header, size, 0, *split_words(10_000) * size]
        return RegisterReply(words, 1_000 * MS, 1_002 * MS)


def make_reader(registers, **options):
    reader = RingBufferReader(registers, lambda: 1_010 * MS, **options)
    reader.start()
    return reader


def test_the_clock_is_read_at_the_start():
    reader = make_reader(Registers(99))
    assert reader.clock_reading == ClockReading(7 * MS, 10, 20)
    assert reader.compute_age() is None


@pytest.mark.parametrize(
    ("identity", "message"),
    [
        ({"identity": 0x4C57}, "identity is 0x4c57, that of a lvdt is 0x4c56"),
        ({"interval": 999}, "samples every 999 us, expected are 1000 us"),
    ],
)
def test_another_instrument_or_rate_is_refused(identity, message):
    with pytest.raises(InvalidReplyError, match=message):
        make_reader(Registers(99, **identity))


def test_all_samples_are_read_block_by_block_without_waiting_between_them():
    registers = Registers(104)
    reader = make_reader(registers, poll_period=1000.0)
    blocks = reader.acquire(10.0)
    assert [(block.first, len(block.values)) for block in blocks] == [(0, 2), (2, 2), (4, 1)]
    assert [first for _, first, _, _ in registers.starts] == [100, 102, 104]
    assert registers.starts[0] == ("block_start", 100, 100, 125)
    assert reader.snapshot()["at_ns"] == 1_002 * MS


def test_the_next_poll_is_one_period_later():
    """With a period beyond the deadline, a second call reads nothing."""
    registers = Registers(100)
    reader = make_reader(registers, poll_period=1000.0)
    assert len(reader.acquire(10.0)) == 1
    assert reader.acquire(0.0) == []
    assert len(registers.starts) == 1


def test_the_age_of_the_newest_sample_includes_the_transfer():
    """It was taken at 8 ms, the block assembled at 9.5 ms, requested 10 ms ago."""
    reader = make_reader(Registers(100))
    reader.acquire(1.0)
    assert reader.compute_age() == pytest.approx(1.5e-3 + 10e-3)


def test_a_block_that_did_not_arrive_is_read_again():
    registers = Registers(101, NoReplyError("lvdt: no reply"), InvalidReplyError("lvdt: garbled"))
    reader = make_reader(registers, poll_period=0.0)
    (block,) = reader.acquire(10.0)
    assert (block.first, len(block.values), len(registers.starts)) == (0, 2, 3)
    assert reader.get_health().message == ""


def test_a_lasting_silence_is_an_error():
    reader = make_reader(Registers(101, NoReplyError("lvdt: no reply")), silence_timeout=-1.0)
    with pytest.raises(
        NotConnectedError, match=r"no good block for 0.0 s, the limit is -1.0 s; last error: lvdt: no"
    ):
        reader.acquire(1.0)


def test_a_line_that_is_gone_is_an_error_at_once():
    with pytest.raises(NotConnectedError, match="gone"):
        make_reader(Registers(101, NotConnectedError("lvdt: gone"))).acquire(1.0)
