import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import OutOfRange
from drivers.modbus_address import ModbusAddress
from drivers.modbus_instrument import check_rate
from drivers.modbus_registers import Type, decode, encode, load_map, value_of, words_in
from drivers.modbus_ring import Layout
from sim_rig.modbus_device import from_words, to_words

RANGES: dict[Type, tuple[int, int]] = {
    "u16": (0, 2**16 - 1),
    "i16": (-(2**15), 2**15 - 1),
    "u32": (0, 2**32 - 1),
    "i32": (-(2**31), 2**31 - 1),
}
INSTRUMENTS = ("lvdt", "coil_amplifier", "thermometer")


@pytest.mark.parametrize("order", ["high_first", "low_first"])
@pytest.mark.parametrize("type_", RANGES)
@given(data=st.data())
def test_a_number_comes_back_from_its_words(type_, order, data):
    number = data.draw(st.integers(*RANGES[type_]))
    assert decode(encode(number, type_, order), type_, order) == number


@pytest.mark.parametrize("low_first", [False, True])
@pytest.mark.parametrize("type_", RANGES)
@given(data=st.data())
def test_driver_and_simulated_instrument_agree_on_every_number(type_, low_first, data):
    order = "low_first" if low_first else "high_first"
    least, most = RANGES[type_]
    number = data.draw(st.integers(least + (type_[0] == "i"), most))
    words = encode(number, type_, order)
    assert to_words(number, type_, 1.0, low_first) == words
    assert from_words(words, type_, 1.0, low_first) == number


def test_the_high_word_stands_first_or_last_as_the_map_says():
    assert encode(0x12345678, "u32", "high_first") == [0x1234, 0x5678]
    assert encode(0x12345678, "u32", "low_first") == [0x5678, 0x1234]


@pytest.mark.parametrize("type_", RANGES)
def test_a_number_that_does_not_fit_is_not_sent(type_):
    with pytest.raises(OutOfRange, match="does not fit"):
        encode(RANGES[type_][1] + 1, type_, "high_first")


def test_the_least_signed_number_means_no_value():
    assert math.isnan(value_of(-(2**31), "i32", 1e-7))
    assert math.isnan(value_of(-(2**15), "i16", 1e-2))
    assert value_of(2**31, "u32", 1.0) == 2**31


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_registers_of_a_map_do_not_overlap(instrument):
    registers = sorted(load_map(instrument).registers.values(), key=lambda r: (r.table, r.address))
    for before, after in itertools.pairwise(registers):
        assert before.table != after.table or before.address + before.words <= after.address


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_a_block_fits_one_request_and_its_columns_are_registers_too(instrument):
    map_ = load_map(instrument)
    layout = Layout(map_)
    assert layout.header_words + layout.capacity * layout.sample_words <= layout.length <= 125
    for column in layout.columns:
        assert map_.registers[column.name].unit == column.unit
        assert map_.registers[column.name].type == column.type
        assert words_in(column.type) == map_.registers[column.name].words


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_the_baud_rate_that_a_wire_file_proposes_carries_its_samples(instrument):
    map_ = load_map(instrument)
    serial = map_.document["serial"]
    address = ModbusAddress("/dev/ttyUSB0", serial["baud"], serial["parity"], serial["stop_bits"])
    assert check_rate("it", address, map_) >= 1.1 * map_.document["ring"]["rate"]


def test_a_line_too_slow_for_the_samples_is_refused_in_one_line():
    with pytest.raises(OutOfRange, match=r"lvdt: 19200 baud carry \d+ samples/s of the 1000") as caught:
        check_rate("lvdt", ModbusAddress("/dev/ttyUSB0", 19200), load_map("lvdt"))
    assert "\n" not in str(caught.value)


def test_a_serial_line_without_a_baud_rate_is_refused():
    with pytest.raises(OutOfRange, match="say its baud rate"):
        check_rate("lvdt", ModbusAddress("/dev/ttyUSB0"), load_map("lvdt"))


def test_tcp_carries_any_rate():
    assert math.isinf(check_rate("lvdt", ModbusAddress("tcp://bench:502"), load_map("lvdt")))
