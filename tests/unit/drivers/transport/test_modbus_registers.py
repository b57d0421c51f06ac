import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import OutOfRangeError
from drivers.modbus.instrument import check_rate
from drivers.modbus.lvdt import Lvdt
from drivers.modbus.ring_buffer_reader import RingBufferLayout
from drivers.transport.modbus_address import ModbusAddress
from drivers.transport.modbus_line import RegisterReply
from drivers.transport.modbus_registers import (
    Registers,
    RegisterType,
    count_words,
    decode_number,
    encode_number,
    load_register_map,
    scale_value,
)
from sim_rig.instruments.modbus_registers import decode_words, encode_words

RANGES: dict[RegisterType, tuple[int, int]] = {
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
    assert decode_number(encode_number(number, type_, order), type_, order) == number


@pytest.mark.parametrize("low_first", [False, True])
@pytest.mark.parametrize("type_", RANGES)
@given(data=st.data())
def test_driver_and_simulated_instrument_agree_on_every_number(type_, low_first, data):
    order = "low_first" if low_first else "high_first"
    low, high = RANGES[type_]
    number = data.draw(st.integers(low + (type_[0] == "i"), high))
    words = encode_number(number, type_, order)
    assert encode_words(number, type_, 1.0, low_first) == words
    assert decode_words(words, type_, 1.0, low_first) == number


def test_the_high_word_is_first_or_last_as_in_the_map():
    assert encode_number(0x12345678, "u32", "high_first") == [0x1234, 0x5678]
    assert encode_number(0x12345678, "u32", "low_first") == [0x5678, 0x1234]


@pytest.mark.parametrize("type_", RANGES)
def test_a_number_that_does_not_fit_is_not_sent(type_):
    with pytest.raises(OutOfRangeError, match="does not fit"):
        encode_number(RANGES[type_][1] + 1, type_, "high_first")


def test_the_smallest_signed_number_means_no_value():
    assert math.isnan(scale_value(-(2**31), "i32", 1e-7))
    assert math.isnan(scale_value(-(2**15), "i16", 1e-2))
    assert scale_value(2**31, "u32", 1.0) == 2**31


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_registers_of_a_map_do_not_overlap(instrument):
    registers = sorted(load_register_map(instrument).registers.values(), key=lambda r: (r.table, r.address))
    for before, after in itertools.pairwise(registers):
        assert before.table != after.table or before.address + before.word_count <= after.address


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_a_block_fits_one_request_and_its_columns_are_registers_too(instrument):
    map_ = load_register_map(instrument)
    layout = RingBufferLayout(map_)
    assert layout.header_words + layout.capacity * layout.sample_words <= layout.length <= 125
    for column in layout.columns:
        assert map_.registers[column.name].unit == column.unit
        assert map_.registers[column.name].type == column.type
        assert count_words(column.type) == map_.registers[column.name].word_count


@pytest.mark.parametrize("instrument", INSTRUMENTS)
def test_the_baud_rate_of_a_wire_file_is_high_enough_for_its_samples(instrument):
    map_ = load_register_map(instrument)
    serial = map_.document["serial"]
    address = ModbusAddress("/dev/ttyUSB0", serial["baud"], serial["parity"], serial["stop_bits"])
    assert check_rate("it", address, map_) >= 1.1 * map_.document["ring"]["rate"]


def test_a_line_too_slow_for_the_samples_is_refused_in_one_line():
    with pytest.raises(OutOfRangeError, match=r"lvdt: 19200 baud transfer \d+ samples/s of the 1000") as caught:
        check_rate("lvdt", ModbusAddress("/dev/ttyUSB0", 19200), load_register_map("lvdt"))
    assert "\n" not in str(caught.value)


def test_a_serial_line_without_a_baud_rate_is_refused():
    with pytest.raises(OutOfRangeError, match="set its baud rate"):
        check_rate("lvdt", ModbusAddress("/dev/ttyUSB0"), load_register_map("lvdt"))


def test_tcp_is_fast_enough_for_any_rate():
    assert math.isinf(check_rate("lvdt", ModbusAddress("tcp://bench:502"), load_register_map("lvdt")))


class RecordingLine:
    """Line that records its requests and returns consecutive words."""

    def __init__(self):
        self.requests = []

    def read(self, table, address, count):
        self.requests.append((table, address, count))
        return RegisterReply(list(range(address, address + count)), 1, 2)

    def write(self, address, words):
        self.requests.append((address, words))


def test_adjacent_registers_are_read_in_one_request():
    """Registers of the LVDT: interval at 2 and 3, newest at 4 and 5, clock at 6 and 7, in any order."""
    registers = Registers(line := RecordingLine(), load_register_map("lvdt"))
    values, reply = registers.read_group("clock", "interval", "newest")
    assert line.requests == [("input", 2, 6)]
    raw = {name: value.raw for name, value in values.items()}
    assert raw == {"clock": 6 * 65_536 + 7, "interval": 2 * 65_536 + 3, "newest": 4 * 65_536 + 5}
    assert values["clock"].value == pytest.approx(0.393223)
    assert (reply.sent_ns, reply.received_ns) == (1, 2)


def test_a_written_value_is_rounded_to_the_steps_of_its_register():
    registers = Registers(line := RecordingLine(), load_register_map("lvdt"))
    registers.write("block_start", 70_000.4)
    assert line.requests == [(0, [1, 4_464])]


def test_a_requested_displacement_has_the_time_of_its_sample():
    lvdt = Lvdt("lvdt", ModbusAddress("tcp://127.0.0.1:5020"), lambda: 0)
    lvdt._registers.line = RecordingLine()
    reading = lvdt.read("displacement")
    # Displacement at 8 and 9, sampled at 10 and 11, status at 12, whose lowest bit is not set.
    assert reading.value == pytest.approx((8 * 65_536 + 9) * 1e-7)
    assert (reading.received_ns, reading.device_ns, reading.quality) == (2, (10 * 65_536 + 11) * 1000, "good")
