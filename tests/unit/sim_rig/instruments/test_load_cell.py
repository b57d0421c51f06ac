"""Frames, requests and tare of the simulated load cell amplifier, without its line."""

import math
import struct

import numpy as np
import pytest

from sim_rig.instruments.load_cell import LoadCellDevice, compute_checksum, encode_frame
from sim_rig.live import DeviceClock

MILLISECOND = 1_000_000
START, STOP, TARE, CLEAR_TARE, SET_RATE, IDENTIFY, READ_CLOCK, SHUNT = range(1, 9)
DONE, UNKNOWN_COMMAND, BAD_ARGUMENT, NOT_NOW = range(4)
OVERLOAD, TARED, STABLE, SENSOR_FAULT, SHUNT_ON = 1, 2, 4, 8, 16


@pytest.fixture
def device(signals):
    return LoadCellDevice(signals, DeviceClock(5_000, 0.0), serial=17)


def ask(device, command, argument=0, now_ns=0):
    """Return code and value of the reply to a request."""
    (reply,) = device.receive(encode_frame("request", 3, command, argument), now_ns)
    token, echoed, code, value = struct.unpack("<BBBi", reply[4:-2])
    assert (token, echoed) == (3, command)
    return code, value


def record(signals, device, forces, start=1):
    """Feed one force [N] per millisecond; return sequence, time [us], counts, tare and status of each frame."""
    times = [(start + k) * MILLISECOND for k in range(len(forces))]
    signals.samples["force"] = list(zip(times, forces, strict=True))
    signals.now = times[-1]
    frames = device.poll(times[-1])
    return [(at // MILLISECOND, *struct.unpack("<HIiiB", frame[4:-2])) for at, frame in frames]


def test_checksum_of_the_nine_digits_is_that_of_the_contract():
    assert compute_checksum(b"123456789") == 0x29B1


def test_frame_has_sync_length_type_payload_and_checksum():
    frame = encode_frame("request", 1, 2, 0x01020304)
    assert frame[:10] == bytes([0xA5, 0x5A, 6, 0x10, 1, 2, 4, 3, 2, 1])
    assert frame[10:] == compute_checksum(frame[2:10]).to_bytes(2, "little")


def test_started_instrument_sends_each_sample_in_counts_with_its_own_clock(signals, device):
    assert record(signals, device, [1.0, 2.0]) == []
    assert ask(device, START) == (DONE, 1000)
    found = record(signals, device, [1.5, -2.0], start=3)
    assert found == [(3, 0, 3005, 1200, 0, 0), (4, 1, 4005, -1600, 0, 0)]
    device.skip_samples(65_533)
    assert [one[1] for one in record(signals, device, [0.0, 0.0], start=5)] == [65_535, 0]
    assert ask(device, STOP) == (DONE, 0)
    assert record(signals, device, [1.0], start=7) == []


@pytest.mark.parametrize(
    ("force", "counts", "status"),
    [
        (9999.0, 7_999_200, 0),
        (10000.0, 8_000_000, OVERLOAD),
        (20000.0, 8_000_000, OVERLOAD),
        (-10000.0, -8_000_000, OVERLOAD),
        (math.nan, 0, SENSOR_FAULT),
    ],
)
def test_force_beyond_full_scale_is_an_overload_and_no_force_a_fault(signals, device, force, counts, status):
    ask(device, START)
    assert record(signals, device, [force]) == [(1, 0, 1005, counts, 0, status)]


def test_stuck_converter_repeats_its_counts_and_an_open_bridge_is_a_fault(signals, device):
    ask(device, START)
    record(signals, device, [1.0])
    device.stuck = True
    assert record(signals, device, [5.0], start=2)[0][3:] == (800, 0, 0)
    device.stuck, device.bridge_open = False, True
    assert record(signals, device, [5.0], start=3)[0][3:] == (800, 0, SENSOR_FAULT)


@pytest.mark.parametrize(("rate", "times"), [(1000, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]), (500, [2, 4, 6, 8, 10])])
def test_samples_are_sent_at_the_rate_that_was_set(signals, device, rate, times):
    assert ask(device, SET_RATE, rate) == (DONE, rate)
    ask(device, START)
    assert [one[0] for one in record(signals, device, [0.0] * 10)] == times


def test_rate_that_does_not_exist_or_changes_a_running_stream_is_refused(signals, device):
    assert ask(device, SET_RATE, 999) == (BAD_ARGUMENT, 1000)
    ask(device, START)
    assert ask(device, SET_RATE, 500) == (NOT_NOW, 1000)
    assert ask(device, 99) == (UNKNOWN_COMMAND, 0)


@pytest.mark.parametrize(
    ("samples", "band", "code"), [(80, 0.0, NOT_NOW), (101, 24.9, DONE), (101, 25.1, NOT_NOW)]
)
def test_tare_needs_a_reading_that_stays_in_its_band_for_the_tare_time(signals, device, samples, band, code):
    record(signals, device, [10.0 + (band if k == 50 else 0.0) for k in range(samples)])
    assert ask(device, TARE)[0] == code


def test_tare_is_the_mean_over_the_last_tenth_of_a_second(signals, device):
    ask(device, START)
    record(signals, device, [500.0] * 100 + [10.0] * 101)
    assert ask(device, TARE) == (DONE, 8000)
    assert record(signals, device, [10.0], start=202)[0][3:] == (8000, 8000, TARED | STABLE)
    assert record(signals, device, [60.0], start=203)[0][5] == TARED
    assert ask(device, CLEAR_TARE) == (DONE, 0)
    assert record(signals, device, [60.0], start=204)[0][4:] == (0, 0)


def test_tare_is_refused_at_overload_and_with_an_open_bridge(signals, device):
    record(signals, device, [10000.0] * 101)
    assert ask(device, TARE)[0] == NOT_NOW
    record(signals, device, [10.0] * 101, start=102)
    device.bridge_open = True
    assert ask(device, TARE)[0] == NOT_NOW


@pytest.fixture
def shunted(signals):
    """Return a device that streams and whose shunt simulates 1000 N."""
    device = LoadCellDevice(signals, DeviceClock(5_000, 0.0), shunt=1000.0)
    ask(device, START)
    return device


def test_shunt_is_commanded_with_its_force_and_in_the_status_until_it_is_off(signals, shunted):
    assert ask(shunted, SHUNT, 60_000) == (DONE, 800_000)
    assert record(signals, shunted, [1001.0])[0][3:] == (800_800, 0, SHUNT_ON)
    assert ask(shunted, SHUNT, 0) == (DONE, 800_000)
    assert record(signals, shunted, [1.0], start=2)[0][3:] == (800, 0, 0)
    assert signals.commands == [("shunt", 1000.0), ("shunt", 0.0)]


def test_shunt_switches_itself_off_and_a_repetition_restarts_its_time(signals, shunted):
    ask(shunted, SHUNT, 10)
    ask(shunted, SHUNT, 10, now_ns=5 * MILLISECOND)
    assert record(signals, shunted, [0.0], start=14)[0][5] == SHUNT_ON
    assert record(signals, shunted, [0.0], start=15)[0][5] == 0
    assert signals.commands == [("shunt", 1000.0), ("shunt", 1000.0), ("shunt", 0.0)]


def test_shunt_is_refused_beyond_its_longest_time_and_without_one(signals, device, shunted):
    assert ask(shunted, SHUNT, 60_001) == (BAD_ARGUMENT, 0)
    assert ask(device, SHUNT, 1) == (UNKNOWN_COMMAND, 0)
    assert signals.commands == []


@pytest.mark.parametrize(
    ("now_ns", "value"),
    [(7_000_000, 7005), (2**31 * 1000 - 5_000, -(2**31)), (2**32 * 1000, 5), (2**31 * 1000 - 6_000, 2**31 - 1)],
)
def test_clock_is_32_bits_of_microseconds_as_a_signed_number(device, now_ns, value):
    assert ask(device, READ_CLOCK, now_ns=now_ns) == (DONE, value)


def test_identity_names_protocol_serial_number_and_calibration(device):
    (reply,) = device.receive(encode_frame("request", 3, IDENTIFY, 0), 0)
    assert struct.unpack("<BBBII", reply[4:-2]) == (3, IDENTIFY, 1, 17, 800)


def test_requests_are_found_in_pieces_and_between_noise(device):
    request = encode_frame("request", 3, STOP, 0)
    damaged = request[:-1] + bytes([request[-1] ^ 1])
    assert device.receive(b"\x00\xa5" + request[:5], 0) == []
    assert len(device.receive(request[5:] + damaged + request + request[:3], 0)) == 2
    assert len(device.receive(request[3:], 0)) == 1


def test_the_stable_bit_is_that_of_a_search_of_the_last_100_ms(signals, device):
    ask(device, START)
    noise = np.random.default_rng(5)
    forces = np.repeat(noise.uniform(-9.0, 9.0, 40), 25) + noise.uniform(-6.0, 6.0, 1000)
    stable = [bool(status & STABLE) for *_, status in record(signals, device, forces.tolist())]
    counts = np.round(forces * 800)
    expected = [k >= 90 and np.ptp(counts[max(k - 100, 0) : k + 1]) <= 25 * 800 for k in range(1000)]
    assert stable == expected
    assert 100 < sum(expected) < 900
