"""Times on a Modbus line: characters, silence between frames, and capacity."""

import math

import pytest

from drivers.errors import OutOfRangeError
from drivers.modbus.instrument import check_rate
from drivers.transport.modbus_address import ModbusAddress, compute_line_capacity
from drivers.transport.modbus_registers import load_register_map

TCP = ModbusAddress("tcp://127.0.0.1:502", baud=9600)


@pytest.mark.parametrize(
    ("parity", "stop_bits", "bits"), [("N", 1, 10), ("N", 2, 11), ("E", 1, 11), ("O", 1, 11), ("E", 2, 12)]
)
def test_a_byte_has_start_data_parity_and_stop_bits(parity, stop_bits, bits):
    line = ModbusAddress("/dev/ttyS0", baud=9600, parity=parity, stop_bits=stop_bits)
    assert line.bits_per_character == bits
    assert line.compute_transfer_time(96) == pytest.approx(bits * 0.01)


@pytest.mark.parametrize(
    ("baud", "silence"), [(9600, 35 / 9600), (19_200, 35 / 19_200), (19_201, 1.75e-3), (115_200, 1.75e-3)]
)
def test_frames_are_separated_by_characters_or_a_fixed_time_at_high_rates(baud, silence):
    line = ModbusAddress("/dev/ttyS0", baud=baud, parity="N", stop_bits=1)
    assert line.silent_interval == pytest.approx(silence)


def test_tcp_takes_no_time():
    assert (TCP.compute_transfer_time(1000), TCP.silent_interval) == (0.0, 0.0)
    assert compute_line_capacity(TCP, [(8, 100)], 0.1) == math.inf


def test_a_serial_line_without_a_baud_rate_has_unknown_times():
    line = ModbusAddress("/dev/ttyS0", baud=None)
    assert (line.compute_transfer_time(1000), line.silent_interval) == (0.0, 0.0)


def test_the_capacity_includes_silence_and_delay_of_each_exchange():
    """240 characters of 10 bits at 9600 Bd take 250 ms; twice per exchange 3.646 ms pass, and 5 ms once."""
    line = ModbusAddress("/dev/ttyS0", baud=9600, parity="N", stop_bits=1)
    seconds = 0.25 + 2 * (2 * 35 / 9600 + 0.005)
    assert compute_line_capacity(line, [(10, 90), (40, 100)], 0.005) == pytest.approx(1 / seconds)


@pytest.mark.parametrize(("baud", "is_sufficient"), [(115_200, True), (57_600, True), (57_000, False)])
def test_a_serial_line_must_transfer_ten_percent_more_than_the_sample_rate(baud, is_sufficient):
    """A block of 57 samples takes 17 + 255 characters: 51.7 ms at 57600 Bd with silence, so 1102 samples/s."""
    line, map_ = ModbusAddress("/dev/ttyS0", baud=baud, parity="N", stop_bits=1), load_register_map("lvdt")
    rate = 57 / (2720 / baud + 2 * 1.75e-3 + 1e-3)
    if is_sufficient:
        assert check_rate("lvdt", line, map_) == pytest.approx(rate)
    else:
        with pytest.raises(OutOfRangeError, match=rf"57000 baud transfer {rate:.0f} samples/s of the 1000"):
            check_rate("lvdt", line, map_)


def test_a_serial_instrument_needs_a_baud_rate():
    with pytest.raises(OutOfRangeError, match="set its baud rate"):
        check_rate("lvdt", ModbusAddress("/dev/ttyS0", baud=None), load_register_map("lvdt"))
