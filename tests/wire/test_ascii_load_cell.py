import time

import numpy as np
import pytest
import serial

from drivers.errors import NoReplyError, NotConnectedError, OutOfRangeError
from drivers.load_cell.ascii_decoder import AsciiLoadCellDecoder
from drivers.load_cell.ascii_load_cell import AsciiLoadCell
from sim_rig.instruments.ascii_load_cell import make_ascii_load_cell
from sim_rig.protocols.serial_port import drop, flip_bit, prepend_noise, truncate
from tests.support.serial_lines import KnownForce, collect, is_equal, join, numbers, wait_until

TCP = "127.0.0.1:0"


def steps(ticks):
    """Return a force [N] that is another whole multiple of 9.80665 N every 20 ms."""
    return 9.80665 * (ticks // 20 % 100)


@pytest.fixture
def rig():
    """Return a function that starts an indicator with a driver that is not connected; stop all at the end."""
    running, drivers = [], []

    def start(force=steps, address="pty", **options):
        adapter, device = make_ascii_load_cell(KnownForce(force), address, **{"rate": 50, **options})
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
    """Return a function that starts an indicator with a connected driver."""

    def start(*arguments, **options):
        adapter, device, driver = rig(*arguments, **options)
        driver.connect()
        return adapter, device, driver

    return start


def is_right(blocks):
    """Return whether every value is one that the indicator has shown."""
    kilograms = join(blocks, "values") / 9.80665
    return np.allclose(kilograms, np.rint(kilograms), atol=1e-9) and kilograms.max() < 100


@pytest.mark.parametrize("address", ["pty", TCP])
def test_every_reading_comes_once_and_is_uncertain(streaming, address):
    _, _, driver = streaming(address=address)
    blocks = collect(driver, 40)
    assert is_right(blocks)
    assert np.all(np.diff(numbers(blocks)) == 1)
    assert {(block.quality, block.device_ns) for block in blocks} == {("uncertain", None)}
    assert driver.get_health().corrupted == driver.get_health().lost == 0


@pytest.mark.parametrize("unit", ["N", "kN", "kg", "lb"])
def test_every_unit_becomes_newtons(streaming, unit):
    _, _, driver = streaming(lambda ticks: np.full(len(ticks), -1234.5), unit=unit)
    assert driver.read("force").value == pytest.approx(-1234.5, abs=0.05)
    assert driver.read("force_raw").quality == "uncertain"


def test_a_net_reading_has_no_untared_force(streaming):
    _, device, driver = streaming(lambda ticks: np.full(len(ticks), 98.0665))
    device.press_tare()
    wait_until(lambda: driver.read("force").value == 0.0, "the net reading")
    with pytest.raises(NoReplyError, match=r"no reading of force_raw .* shows gross"):
        driver.read("force_raw")


@pytest.mark.parametrize(("fault", "refused"), [(truncate, 1), (prepend_noise, 3), (flip_bit, 0), (drop, 0)])
def test_a_faulty_line_is_refused_and_counted(streaming, fault, refused):
    adapter, _, driver = streaming()
    blocks = collect(driver, 5)
    adapter.faults.inject(fault, 3)
    wait_until(lambda: bool(blocks.extend(driver.acquire(0.05))) or not adapter.faults.pending_count, "the fault")
    blocks = [block for block in blocks if block.channel == "force"] + collect(driver, 5)
    assert driver.get_health().corrupted >= refused
    assert driver.get_health().corrupted == np.sum(np.diff(numbers(blocks)) - 1)
    if fault is not flip_bit:
        assert is_right(blocks)


def test_an_implausible_value_is_refused(streaming):
    adapter, _, driver = streaming()
    collect(driver, 5)
    adapter.faults.inject(lambda line: line.replace(b"+0", b"+9"))
    adapter.faults.inject(lambda line: line.replace(b"+00", b"-09"))
    blocks = collect(driver, 10)
    assert driver.get_health().corrupted == 2
    assert is_right(blocks)


def test_an_overload_is_reported_and_its_readings_are_lost(streaming):
    _, _, driver = streaming(lambda ticks: np.where(ticks < 300, 50.0, 12000.0))
    wait_until(
        lambda: driver.acquire(0.05) is not None and driver.get_health().message == "overload", "the overload"
    )
    assert driver.get_health().lost > 0


def test_silence_is_reported(streaming):
    adapter, _, driver = streaming()
    adapter.faults.silent = True
    wait_until(lambda: not driver.acquire(0.2) and "silent for" in driver.get_health().message, "silence")
    with pytest.raises(NoReplyError, match="no reading of force within 1 s"):
        driver.read("force")
    adapter.faults.silent = False
    collect(driver, 5)
    assert driver.get_health().message == ""


def test_a_silent_indicator_is_no_reply(rig):
    adapter, _, driver = rig()
    adapter.faults.silent = True
    with pytest.raises(NoReplyError, match="indicator: no reading within 2 s, 0 lines refused"):
        driver.connect()
    assert driver.get_health().message == "not connected"


def test_a_pulled_cable_is_reported_and_the_driver_connects_again(streaming):
    adapter, _, driver = streaming(address=TCP)
    adapter.hang_up()
    with pytest.raises(NotConnectedError, match="is gone"):
        wait_until(lambda: driver.acquire(0.05) is None, "the end of the line")
    driver.connect()
    assert is_right(collect(driver, 10))


def test_an_indicator_has_no_writable_channel(rig):
    _, _, driver = rig()
    with pytest.raises(OutOfRangeError, match="force is measured and cannot be set to 2 N"):
        driver.write("force", 2.0)
    with pytest.raises(OutOfRangeError, match="no channel 'tare'"):
        driver.read("tare")
    with pytest.raises(NotConnectedError, match="connect first"):
        driver.acquire(0.0)
    driver.make_safe()


def test_replay_of_the_recorded_bytes_gives_the_same_blocks_bit_for_bit(rig):
    adapter, _, driver = rig()
    frames, live = [], []
    driver.add_listener(frames.append)
    driver.connect()
    adapter.faults.inject(truncate, 2)
    wait_until(lambda: bool(live.extend(driver.acquire(0.05))) or len(live) > 30, "readings")
    decoder = AsciiLoadCellDecoder()
    replayed = [block for frame in frames for block in decoder.feed(frame.received_ns, frame.data)]
    assert len(live) <= len(replayed)
    assert all(is_equal(one, other) for one, other in zip(live, replayed, strict=False))


def test_a_plain_serial_reader_can_decode_the_indicator(rig):
    adapter, _, _ = rig()
    with serial.serial_for_url(adapter.address, 9600, timeout=1.0) as port:
        port.readline()
        lines = [port.readline() for _ in range(10)]
    assert all(line[:7] in (b"ST,GS,+", b"US,GS,+") and line[-5:] == b" kg\r\n" for line in lines)
    assert all(float(line[7:14]) == round(float(line[7:14])) for line in lines)
