import time

import numpy as np
import pytest
import serial
from serial_examples import KnownForce, awaited, collected, joined, numbers, same

from drivers.ascii_load_cell import AsciiLoadCell
from drivers.ascii_load_cell_stream import ReadingStream
from drivers.errors import NoReply, NotConnected, OutOfRange
from sim_rig.serial_ascii_load_cell import serial_ascii_load_cell
from sim_rig.serial_port import corrupted, cut, lost, with_garbage

TCP = "127.0.0.1:0"


def steps(ticks):
    """[N] another whole multiple of 9.80665 N every 20 ms."""
    return 9.80665 * (ticks // 20 % 100)


@pytest.fixture
def rig():
    """Starts indicators, each with a driver that is not connected yet; stops them all."""
    running, drivers = [], []

    def start(force=steps, address="pty", **options):
        adapter, device = serial_ascii_load_cell(KnownForce(force), address, **{"rate": 50, **options})
        adapter.start()
        running.append(adapter)
        drivers.append(AsciiLoadCell("indicator", adapter.address, time.monotonic_ns))
        return adapter, device, drivers[-1]

    yield start
    for driver in drivers:
        driver.close()
    for adapter in running:
        adapter.stop()


@pytest.fixture
def streaming(rig):
    """The same, connected."""

    def start(*arguments, **options):
        adapter, device, driver = rig(*arguments, **options)
        driver.connect()
        return adapter, device, driver

    return start


def right(blocks):
    """Every value is one that the indicator has shown."""
    kilograms = joined(blocks, "values") / 9.80665
    return np.allclose(kilograms, np.rint(kilograms), atol=1e-9) and kilograms.max() < 100


@pytest.mark.parametrize("address", ["pty", TCP])
def test_every_reading_comes_once_and_is_uncertain(streaming, address):
    _, _, driver = streaming(address=address)
    blocks = collected(driver, 40)
    assert right(blocks)
    assert np.all(np.diff(numbers(blocks)) == 1)
    assert {(block.quality, block.device_ns) for block in blocks} == {("uncertain", None)}
    assert driver.health().corrupted == driver.health().lost == 0


@pytest.mark.parametrize("unit", ["N", "kN", "kg", "lb"])
def test_every_unit_becomes_newtons(streaming, unit):
    _, _, driver = streaming(lambda ticks: np.full(len(ticks), -1234.5), unit=unit)
    assert driver.read("force").value == pytest.approx(-1234.5, abs=0.05)
    assert driver.read("force_raw").quality == "uncertain"


def test_a_net_reading_does_not_know_the_untared_force(streaming):
    _, device, driver = streaming(lambda ticks: np.full(len(ticks), 98.0665))
    device.press_tare()
    awaited(lambda: driver.read("force").value == 0.0, "the net reading")
    with pytest.raises(NoReply, match=r"no reading of force_raw .* shows gross"):
        driver.read("force_raw")


@pytest.mark.parametrize(("harm", "refused"), [(cut, 1), (with_garbage, 3), (corrupted, 0), (lost, 0)])
def test_a_harmed_line_is_refused_and_counted(streaming, harm, refused):
    adapter, _, driver = streaming()
    blocks = collected(driver, 5)
    adapter.faults.inject(harm, 3)
    awaited(lambda: bool(blocks.extend(driver.acquire(0.05))) or not adapter.faults.pending, "the harm")
    blocks = [block for block in blocks if block.channel == "force"] + collected(driver, 5)
    assert driver.health().corrupted >= refused
    assert driver.health().corrupted == np.sum(np.diff(numbers(blocks)) - 1)
    if harm is not corrupted:
        assert right(blocks)


def test_a_wild_value_is_refused(streaming):
    adapter, _, driver = streaming()
    collected(driver, 5)
    adapter.faults.inject(lambda line: line.replace(b"+0", b"+9"))
    adapter.faults.inject(lambda line: line.replace(b"+00", b"-09"))
    blocks = collected(driver, 10)
    assert driver.health().corrupted == 2
    assert right(blocks)


def test_an_overload_is_told_and_its_readings_are_lost(streaming):
    _, _, driver = streaming(lambda ticks: np.where(ticks < 300, 50.0, 12000.0))
    awaited(lambda: driver.acquire(0.05) is not None and driver.health().words == "overload", "the overload")
    assert driver.health().lost > 0


def test_silence_is_told(streaming):
    adapter, _, driver = streaming()
    adapter.faults.silent = True
    awaited(lambda: not driver.acquire(0.2) and "silent for" in driver.health().words, "silence")
    with pytest.raises(NoReply, match="no reading of force within 1 s"):
        driver.read("force")
    adapter.faults.silent = False
    collected(driver, 5)
    assert driver.health().words == ""


def test_a_silent_indicator_is_no_reply(rig):
    adapter, _, driver = rig()
    adapter.faults.silent = True
    with pytest.raises(NoReply, match="indicator: no reading within 2 s, 0 lines refused"):
        driver.connect()
    assert driver.health().words == "not connected"


def test_a_pulled_cable_is_told_and_the_driver_connects_again(streaming):
    adapter, _, driver = streaming(address=TCP)
    adapter.hang_up()
    with pytest.raises(NotConnected, match="has gone"):
        awaited(lambda: driver.acquire(0.05) is None, "the end of the line")
    driver.connect()
    assert right(collected(driver, 10))


def test_an_indicator_takes_no_values(rig):
    _, _, driver = rig()
    with pytest.raises(OutOfRange, match="force is measured, never set to 2 N"):
        driver.write("force", 2.0)
    with pytest.raises(OutOfRange, match="no channel 'tare'"):
        driver.read("tare")
    with pytest.raises(NotConnected, match="connect first"):
        driver.acquire(0.0)
    driver.make_safe()


def test_replay_of_the_recorded_bytes_gives_the_same_blocks_bit_for_bit(rig):
    adapter, _, driver = rig()
    frames, live = [], []
    driver.listen(frames.append)
    driver.connect()
    adapter.faults.inject(cut, 2)
    awaited(lambda: bool(live.extend(driver.acquire(0.05))) or len(live) > 30, "readings")
    stream = ReadingStream()
    again = [block for frame in frames for block in stream.feed(frame.received_ns, frame.data)]
    assert len(live) <= len(again)
    assert all(same(one, other) for one, other in zip(live, again, strict=False))


def test_a_plain_serial_reader_understands_the_indicator(rig):
    adapter, _, _ = rig()
    with serial.serial_for_url(adapter.address, 9600, timeout=1.0) as port:
        port.readline()
        lines = [port.readline() for _ in range(10)]
    assert all(line[:7] in (b"ST,GS,+", b"US,GS,+") and line[-5:] == b" kg\r\n" for line in lines)
    assert all(float(line[7:14]) == round(float(line[7:14])) for line in lines)
