"""The LVDT conditioner: driver and simulated instrument, over every wire."""

import time

import numpy as np
import pytest

from drivers.errors import DriverError, InvalidReplyError, NotConnectedError, OutOfRangeError
from drivers.modbus.lvdt import Lvdt
from drivers.transport.modbus_address import ModbusAddress
from sim_rig.instruments.modbus_sensor import SensorDevice
from sim_rig.live.device_clock import DeviceClock
from sim_rig.protocols.modbus_server import ReplyFault
from tests.support.modbus_bench import MS, RESOLUTION, TIMEOUT, WIRES, FakeSignals, serve, truth, wait_until

pytestmark = pytest.mark.timeout(60)
CLOCK = DeviceClock(offset_ns=77_000_000_000, ppm=-38.0)


class Bench:
    """Conditioner on its wire, and its connected driver."""

    def __init__(self, signals, device, server, driver):
        self.signals, self.device, self.server, self.driver = signals, device, server, driver

    def collect(self, samples):
        """Acquire blocks until there are so many samples."""
        blocks = []

        def is_enough():
            blocks.extend(self.driver.acquire(0.05))
            return sum(len(block.values) for block in blocks) >= samples

        wait_until(is_enough)
        return blocks


@pytest.fixture(params=WIRES)
def bench(request):
    signals = FakeSignals()
    device = SensorDevice("lvdt", signals, CLOCK)
    with serve(device, request.param) as (server, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        driver.connect()
        yield Bench(signals, device, server, driver)
        driver.close()


def assert_true(blocks, clock=CLOCK, first=0):
    """Check that the blocks are without gap from ``first`` on, with the values and times of the rig."""
    numbers = np.concatenate([block.first + np.arange(len(block.values)) for block in blocks])
    assert np.array_equal(numbers, first + np.arange(len(numbers)))
    times = np.concatenate([block.device_ns for block in blocks])
    values = np.concatenate([block.values for block in blocks])
    rig_ns = (times - clock.offset_ns) / (1 + clock.ppm * 1e-6)
    grid = np.rint(rig_ns / MS).astype(np.int64) * MS
    assert np.abs(rig_ns - grid).max() < 10_000  # a microsecond of resolution, and the rate error within a block
    assert np.all(np.diff(grid) == MS)
    assert np.abs(values - truth("displacement", grid)).max() <= RESOLUTION["displacement"]


def test_samples_are_complete_and_in_order_with_their_times(bench):
    bench.signals.step(500)
    blocks = bench.collect(500)
    assert_true(blocks)
    assert {block.quality for block in blocks} == {"good"}
    assert bench.driver.get_health().lost == 0


def test_without_new_samples_there_are_no_blocks(bench):
    assert bench.driver.acquire(0.05) == []
    bench.signals.step(3)
    assert sum(len(block.values) for block in bench.collect(3)) == 3


FAULTS = [
    ReplyFault("drop"),
    ReplyFault("delay", 2.5 * TIMEOUT),
    ReplyFault("crc"),
    ReplyFault("truncate"),
    ReplyFault("unit"),
    ReplyFault("exception", 6),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_a_failed_block_is_read_again_without_loss(bench, fault):
    bench.signals.step(40)
    bench.server.inject(fault, times=2, function=23)
    blocks = bench.collect(40)
    bench.signals.step(40)
    assert_true(blocks + bench.collect(40))
    assert bench.server.pending_faults == 0
    assert bench.driver.get_health().lost == 0
    assert bench.driver.get_health().message == ""


def test_a_stale_block_is_not_taken_for_the_requested_one(bench):
    bench.signals.step(30)
    blocks = bench.collect(30)
    bench.signals.step(30)
    bench.server.inject(ReplyFault("stale"), function=23)
    assert_true(blocks + bench.collect(30))
    assert bench.server.pending_faults == 0
    assert bench.driver.get_health().lost == 0


def test_samples_that_were_overwritten_are_counted(bench):
    bench.signals.step(10_000)
    blocks = bench.collect(4096)
    assert blocks[0].first == bench.driver.get_health().lost == 10_000 - 4096
    assert_true(blocks, first=10_000 - 4096)


def test_the_device_clock_is_unwrapped():
    signals = FakeSignals()
    clock = DeviceClock(offset_ns=2**32 * 1000 - signals.now_ns() - 50 * MS)
    with serve(SensorDevice("lvdt", signals, clock), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        driver.connect()
        times = []
        for _ in range(4):
            signals.step(30)
            wait_until(
                lambda: times.extend(t for b in driver.acquire(0.05) for t in b.device_ns) or len(times) % 30 == 0
            )
        driver.close()
    assert np.all(np.diff(times) == MS)


def test_the_age_of_the_newest_sample_is_known():
    signals, bench_ns = FakeSignals(), [0]
    with serve(SensorDevice("lvdt", signals), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, lambda: bench_ns[0], unit=1, timeout=TIMEOUT)
        driver.connect()
        assert driver.compute_age() is None
        signals.step(20.4)
        wait_until(lambda: bool(driver.acquire(0.05)))
        assert driver.compute_age() == pytest.approx(0.4e-3, abs=2e-6)
        bench_ns[0] += 30 * MS
        assert driver.compute_age() == pytest.approx(30.4e-3, abs=2e-6)
        driver.close()


def test_its_clock_is_read_between_request_and_reply(bench):
    bench.signals.step(20)
    bench.collect(20)
    reading = bench.driver.clock_reading
    assert reading.sent_ns < reading.received_ns
    assert abs(reading.device_ns - CLOCK.read_ns(bench.signals.now_ns())) <= 1000


def test_one_value_can_be_requested(bench):
    reading = bench.driver.read("displacement")
    assert reading.value == pytest.approx(truth("displacement", np.array([bench.signals.now_ns()]))[0], abs=1e-7)
    assert reading.value == pytest.approx(reading.raw * 1e-7)
    assert (reading.device_ns, reading.quality) == (CLOCK.read_ns(bench.signals.now_ns()) // 1000 * 1000, "good")


def test_a_missing_core_gives_no_value(bench):
    bench.signals.dead.add("displacement")
    bench.signals.step(5)
    (block,) = bench.collect(5)
    assert np.isnan(block.values).all()
    assert block.quality == bench.driver.read("displacement").quality == "bad"


def test_an_instrument_that_restarts_must_be_connected_again(bench):
    bench.signals.step(5)
    bench.collect(5)
    bench.device.ring_buffer.restart()
    with pytest.raises(NotConnectedError, match=r"restarted \(1 power-ups, now 2\)"):
        wait_until(lambda: bench.driver.acquire(0.05) is None)
    bench.driver.connect()
    bench.signals.step(5)
    assert bench.collect(5)[0].first == 0


def test_a_lasting_silence_is_not_connected(bench):
    bench.server.silent = True
    with pytest.raises(NotConnectedError, match="no good block for"):
        wait_until(lambda: bench.driver.acquire(0.05) is None)
    assert "0." in bench.driver.get_health().message
    bench.server.silent = False
    wait_until(lambda: _connects(bench.driver))
    bench.signals.step(5)
    assert bench.collect(5)[0].first == 0


def _connects(driver):
    try:
        driver.connect()
    except DriverError:
        return False
    return True


def test_another_instrument_is_not_taken_for_a_conditioner():
    with serve(SensorDevice("thermometer", FakeSignals()), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        with pytest.raises(InvalidReplyError, match="its identity is 0x5448, that of a lvdt is 0x4c56"):
            driver.connect()
        assert not driver.get_health().connected


def test_a_serial_line_that_is_too_slow_is_refused_before_it_is_opened():
    with pytest.raises(OutOfRangeError, match="38400 baud transfer"):
        Lvdt("lvdt", ModbusAddress("/dev/ttyUSB0", 38400), time.monotonic_ns)


def test_it_has_one_channel_which_cannot_be_set(bench):
    assert [(c.name, c.unit, c.access) for c in bench.driver.channels] == [("displacement", "m", "read")]
    with pytest.raises(OutOfRangeError, match="only measures"):
        bench.driver.write("displacement", 0.0)
    with pytest.raises(OutOfRangeError, match="no channel 'force'"):
        bench.driver.read("force")
    bench.driver.make_safe()


def test_at_its_stated_baud_rate_the_line_keeps_up():
    """Runs in real time: 1000 samples per second, and each reply takes the transfer time of its bytes."""
    signals = FakeSignals(0)
    start_ns = time.monotonic_ns()
    signals.now_ns = lambda: time.monotonic_ns() - start_ns + 5_000 * MS
    with serve(SensorDevice("lvdt", signals), "rtu over pty") as (server, address):
        server.baud = 115200
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=0.3)
        driver.connect()
        blocks = []
        wait_until(lambda: blocks.extend(driver.acquire(0.1)) or sum(len(b.values) for b in blocks) >= 1000, 20)
        driver.close()
    assert_true(blocks, DeviceClock())
