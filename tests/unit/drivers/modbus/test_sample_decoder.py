"""Blocks of the ring buffer: numbers, times, losses and values, with the registers of the wire files."""

import math

import numpy as np
import pytest

from drivers.errors import InvalidReplyError, NotConnectedError
from drivers.modbus.sample_decoder import ModbusDecoder, RingBufferLayout
from drivers.transport.modbus_registers import load_register_map

MS = 1_000_000
HEADER_WORDS = 11
"""Words of the header: boot 1, first 2, time 2, clock 2, newest 2, count 1, status 1."""
CAPACITY = 57
"""Samples of two words each in 125 - 11 words."""


def split_words(number):
    return [number >> 16 & 0xFFFF, number & 0xFFFF]


def make_words(first, counts, time=5_000, clock=9_000, newest=None, status=0, boot=3, count=None):
    """Return a block of samples with the given counts; clocks in us."""
    newest = (first + len(counts) - 1) % 2**32 if newest is None else newest
    header = [boot, *split_words(first), *split_words(time), *split_words(clock), *split_words(newest)]
    samples = [word for one in counts for word in split_words(one % 2**32)]
    return [*header, len(counts) if count is None else count, status, *samples]


def make_decoder(newest=99, clock=4_000):
    decoder = ModbusDecoder("lvdt", RingBufferLayout(load_register_map("lvdt")))
    decoder.begin(3, newest, clock)
    return decoder


def test_the_layout_is_that_of_the_wire_file():
    layout = RingBufferLayout(load_register_map("lvdt"))
    assert (layout.header_words, layout.sample_words, layout.capacity) == (HEADER_WORDS, 2, CAPACITY)
    assert (layout.interval_ns, layout.size) == (MS, 4096)


def test_samples_have_numbers_times_and_si_values():
    decoder = make_decoder()
    readout = decoder.decode_block(make_words(100, [70_000, -1, 65_536]), 77)
    (block,) = readout.blocks
    assert (block.channel, block.first, block.received_ns, block.quality) == ("displacement", 0, 77, "good")
    assert block.device_ns.tolist() == [5 * MS, 6 * MS, 7 * MS]
    assert block.raw.tolist() == [70_000, -1, 65_536]
    assert block.values == pytest.approx([7e-3, -1e-7, 6.5536e-3], rel=1e-12)
    assert (readout.clock_ns, readout.has_more) == (9 * MS, False)
    assert (decoder.next_number, decoder.newest_ns, decoder.lost) == (103, 7 * MS, 0)


def test_numbers_count_on_over_the_next_block():
    decoder = make_decoder()
    decoder.decode_block(make_words(100, [1, 2, 3]), 0)
    (block,) = decoder.decode_block(make_words(103, [4], time=8_000), 0).blocks
    assert (block.first, block.raw.tolist()) == (3, [4])


@pytest.mark.parametrize(("newest", "has_more"), [(101, False), (102, True), (150, True)])
def test_more_samples_are_waiting_if_the_newest_one_is_later(newest, has_more):
    assert make_decoder().decode_block(make_words(100, [1, 2], newest=newest), 0).has_more is has_more


def test_an_empty_block_changes_no_number():
    decoder = make_decoder()
    readout = decoder.decode_block(make_words(100, [], newest=99), 0)
    assert (readout.blocks, readout.has_more) == ([], False)
    assert (decoder.next_number, decoder.newest_ns) == (100, None)


@pytest.mark.parametrize("newest", [2**32 - 2, 2**32 - 1])
def test_numbers_and_clock_are_unwrapped(newest):
    first = (newest + 1) % 2**32
    decoder = make_decoder(newest, 2**32 - 1_000)
    decoder.decode_block(make_words(first, [1, 2], time=2**32 - 500, clock=200), 0)
    (block,) = decoder.decode_block(make_words((first + 2) % 2**32, [3], time=1_500, clock=1_600), 0).blocks
    assert (block.first, decoder.lost) == (2, 0)
    assert block.device_ns.tolist() == [(2**32 + 1_500) * 1_000]


def test_a_ring_that_has_overrun_loses_the_samples_before_the_oldest_one():
    """The newest of 4096 kept samples is the one before the first."""
    decoder = make_decoder()
    (block,) = decoder.decode_block(make_words(5_000, [1], newest=5_000 + 4_095), 0).blocks
    assert (block.first, decoder.lost, decoder.next_number) == (4_900, 4_900, 5_001)


@pytest.mark.parametrize(
    "words",
    [
        make_words(5_000, [1], newest=5_000 + 4_096),  # no longer kept
        make_words(101, [1], newest=100),  # not taken yet
        make_words(99, [1, 2], newest=150),  # before the requested one
        make_words(100, [1] * (CAPACITY + 1)),
    ],
)
def test_a_block_that_was_not_requested_is_refused(words):
    decoder = make_decoder()
    with pytest.raises(InvalidReplyError, match=r"but 100 was requested and 57 is the most; it was not used"):
        decoder.decode_block(words, 0)
    assert (decoder.next_number, decoder.lost) == (100, 0)


def test_a_full_block_is_accepted():
    (block,) = make_decoder().decode_block(make_words(100, list(range(CAPACITY))), 0).blocks
    assert block.raw.tolist() == list(range(CAPACITY))


def test_a_block_with_the_only_kept_sample_is_accepted():
    assert make_decoder().decode_block(make_words(101, [1], newest=101), 0).blocks[0].first == 1


def test_a_restarted_instrument_is_not_connected():
    with pytest.raises(NotConnectedError, match=r"restarted \(3 power-ups, now 4\)"):
        make_decoder().decode_block(make_words(100, [1], boot=4), 0)


@pytest.mark.parametrize(
    ("counts", "status", "quality"), [([1, 2], 0, "good"), ([1, 2], 1, "uncertain"), ([1, 2], 2, "good")]
)
def test_the_status_determines_the_quality(counts, status, quality):
    decoder = make_decoder()
    assert decoder.decode_block(make_words(100, counts, status=status), 0).blocks[0].quality == quality
    assert decoder.status == status


def test_a_sample_without_a_value_makes_the_block_bad():
    (block,) = make_decoder().decode_block(make_words(100, [2, -(2**31), 1 - 2**31]), 0).blocks
    assert block.quality == "bad"
    assert [math.isnan(value) for value in block.values] == [False, True, False]


def test_columns_of_one_and_two_words_are_separated():
    """A sample of the coil amplifier: a voltage of 0.1 mV in two words, a current of 0.1 mA in one."""
    layout = RingBufferLayout(load_register_map("coil_amplifier"))
    assert [column.name for column in layout.columns] == ["coil_voltage", "coil_current"]
    words = [0] * layout.header_words + [0, 1_000, 0x8001, 0xFFFF, 0xFFFE, 0x7FFF]
    voltage, current = layout.decode_samples(words, 2)
    assert voltage.tolist() == [1_000, -2]
    assert current.tolist() == [-0x7FFF, 0x7FFF]
    assert np.array_equal(layout.decode_samples(words, 1)[1], [-0x7FFF])


def test_a_restored_decoder_continues():
    decoder, other = make_decoder(), make_decoder(0, 0)
    decoder.decode_block(make_words(100, [1, 2], clock=2**31), 0)
    other.restore(decoder.snapshot())
    words = make_words(102, [3], time=2**31 + 100, clock=2**31 + 200)
    (block,) = other.decode_block(words, 0).blocks
    assert (block.first, block.device_ns.tolist()) == (2, [(2**31 + 100) * 1_000])
