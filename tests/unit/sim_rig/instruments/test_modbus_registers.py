"""Words, registers and ring buffer of the simulated Modbus instruments."""

import math

import pytest

from sim_rig.instruments.modbus_registers import (
    RegisterBank,
    RegisterSection,
    SampleRingBuffer,
    count_words,
    decode_words,
    encode_words,
)
from sim_rig.live import DeviceClock
from sim_rig.protocols import ModbusRequestError

MILLISECOND = 1_000_000


@pytest.mark.parametrize(("type_", "scale", "value", "words", "restored"), [
    ("u16", 1.0, 65535, [65535], 65535),
    ("u16", 1.0, 65536, [65535], 65535),
    ("u16", 1.0, -1, [0], 0),
    ("i16", 1.0, 32768, [32767], 32767),
    ("i16", 1.0, -1, [65535], -1),
    ("i16", 1.0, -40000, [32769], -32767),
    ("i16", 1.0, math.nan, [32768], -32768),
    ("i16", 0.5, 3.0, [6], 3.0),
    ("u32", 1.0, 65537, [1, 1], 65537),
    ("u32", 1.0, 2**40, [65535, 65535], 2**32 - 1),
    ("i32", 1.0, -2, [65535, 65534], -2),
    ("i32", 1.0, math.nan, [32768, 0], -(2**31)),
    ("i32", 1e-3, 131.073, [2, 1], 131.073),
])  # fmt: skip
def test_numbers_are_registers_saturated_at_the_range_of_their_type(type_, scale, value, words, restored):
    for low_first in (False, True):
        ordered = words[::-1] if low_first else words
        assert encode_words(value, type_, scale, low_first) == ordered
        assert decode_words(ordered, type_, scale, low_first) == pytest.approx(restored)


def test_types_have_one_register_for_each_16_bits():
    assert [count_words(type_) for type_ in ("u16", "i16", "u32", "i64")] == [1, 1, 2, 4]


REGISTERS = [
    {"name": "status", "address": 10, "type": "u16", "access": "read"},
    {"name": "value", "address": 11, "type": "i32", "access": "read", "scale": 0.1},
    {"name": "limit", "address": 20, "type": "i32", "access": "write", "scale": 0.1, "low": -1.0, "high": 2.0},
    {"name": "mode", "address": 22, "type": "u16", "access": "write"},
]


@pytest.fixture
def bank():
    values, table = {"status": 7, "value": -0.2, "limit": 1.5, "mode": 3}, [1, 2, 3, 4]

    def write_table(offset, words):
        table[offset : offset + len(words)] = words

    made = RegisterBank(
        {"register": REGISTERS, "word_order": "high_first"},
        {name: (lambda name=name: values[name]) for name in values},
        {name: (lambda value, name=name: values.update({name: value})) for name in ("limit", "mode")},
        [RegisterSection((3,), 100, 4, lambda: table, write_table)],
    )
    made.values, made.table = values, table
    return made


@pytest.mark.parametrize(
    ("function", "address", "count", "words"),
    [
        (4, 10, 3, [7, 65535, 65534]),
        (4, 12, 1, [65534]),
        (3, 20, 3, [0, 15, 3]),
        (3, 100, 4, [1, 2, 3, 4]),
        (3, 101, 2, [2, 3]),
    ],
)
def test_registers_are_read_in_whole_or_in_part(bank, function, address, count, words):
    assert bank.read(function, address, count) == words


@pytest.mark.parametrize(
    ("function", "address", "count"),
    [(4, 9, 2), (4, 12, 2), (3, 10, 1), (4, 20, 1), (4, 100, 1), (3, 99, 2), (3, 100, 5)],
)
def test_registers_that_do_not_exist_are_refused(bank, function, address, count):
    with pytest.raises(ModbusRequestError):
        bank.read(function, address, count)


def test_registers_and_sections_are_written(bank):
    bank.write(20, [0, 20, 1])
    assert (bank.values["limit"], bank.values["mode"]) == (pytest.approx(2.0), 1)
    bank.write(20, [65535, 65526])
    assert bank.values["limit"] == pytest.approx(-1.0)
    bank.write(102, [8, 9])
    assert bank.table == [1, 2, 8, 9]


@pytest.mark.parametrize(("address", "words"), [
    (20, [0, 21]), (20, [65535, 65525]), (20, [0]), (21, [0]),
    (10, [1]), (22, [1, 1]), (103, [1, 2]), (99, [1, 2]),
])  # fmt: skip
def test_values_beyond_their_limits_and_incomplete_registers_are_refused(bank, address, words):
    with pytest.raises(ModbusRequestError):
        bank.write(address, words)
    assert (bank.values["limit"], bank.values["mode"], bank.table) == (1.5, 3, [1, 2, 3, 4])


HEADER = ("boot", "first", "time", "clock", "newest", "count", "status")
RING = {
    "identity": 42,
    "word_order": "high_first",
    "ring": {
        "rate": 1000, "size": 8, "address": 500, "length": 13,
        "header": [{"name": name, "type": "u16"} for name in HEADER],
        "columns": [{"name": "a", "type": "i16", "scale": 0.1}, {"name": "b", "type": "i16", "scale": 1.0}],
    },
}  # fmt: skip


@pytest.fixture
def ring(signals):
    return SampleRingBuffer(RING, signals, DeviceClock(5_000, 0.0), lambda: 9)


def record(signals, count, channels=("a", "b")):
    for name in channels:
        signals.samples[name] = [(k * MILLISECOND, 0.1 * k if name == "a" else 100 + k) for k in range(count)]
    signals.now = (count - 1) * MILLISECOND + 400_000


def test_block_holds_the_samples_from_the_requested_one_up_to_its_capacity(signals, ring):
    record(signals, 7)
    ring.set_start(2.0)
    assert ring.make_block() == [1, 2, 2005, 6405, 6, 3, 9, 2, 102, 3, 103, 4, 104]
    ring.set_start(5.0)
    assert ring.make_block() == [1, 5, 5005, 6405, 6, 2, 9, 5, 105, 6, 106, 0, 0]


def test_block_begins_at_the_oldest_sample_that_is_kept(signals, ring):
    record(signals, 20)
    assert ring.make_block()[:6] == [1, 12, 12005, 19405, 19, 3]


def test_block_ends_at_the_newest_sample_of_all_channels(signals, ring):
    record(signals, 7)
    del signals.samples["b"][5:]
    ring.set_start(4)
    assert ring.make_block()[:9] == [1, 4, 4005, 6405, 4, 1, 9, 4, 104]
    del signals.samples["b"][:]
    assert ring.make_block()[4:6] == [0, 0]


def test_restart_counts_samples_and_time_from_zero(signals, ring):
    record(signals, 7)
    ring.restart()
    assert (ring.boot, ring.start_number, ring.read_clock_us(signals.now)) == (2, 0, 0)
    record(signals, 10)
    ring.set_start(1)
    assert ring.make_block()[:9] == [2, 1, 600, 3000, 3, 3, 9, 7, 107]


def test_registers_of_a_ring_buffer_are_in_seconds_and_units(signals, ring):
    getters = ring.make_getters()
    assert math.isnan(getters["a"]())
    record(signals, 7)
    assert (getters["identity"](), getters["boot"](), getters["newest"]()) == (42, 1, 6)
    found = [getters[name]() for name in ("interval", "clock", "sampled", "a", "b")]
    assert found == pytest.approx([1e-3, 6.405e-3, 6.005e-3, 0.6, 106])
