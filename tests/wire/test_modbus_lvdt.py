"""The LVDT conditioner: driver against simulated instrument, over every wire."""

import time

import numpy as np
import pytest
from modbus_bench import MS, TIMEOUT, UNITS, WIRES, FakeSignals, served, truth, until

from drivers.errors import BadReply, DriverError, NotConnected, OutOfRange
from drivers.lvdt import Lvdt
from drivers.modbus_address import ModbusAddress
from sim_rig.device_clock import DeviceClock
from sim_rig.modbus_lvdt import LvdtDevice
from sim_rig.modbus_server import WireFault
from sim_rig.modbus_thermometer import ThermometerDevice

pytestmark = pytest.mark.timeout(60)
CLOCK = DeviceClock(offset_ns=77_000_000_000, ppm=-38.0)


class Bench:
    """A conditioner on its wire and its driver, connected."""

    def __init__(self, signals, device, server, driver):
        self.signals, self.device, self.server, self.driver = signals, device, server, driver

    def collect(self, samples):
        """Blocks until so many samples have come."""
        blocks = []
        until(lambda: blocks.extend(self.driver.acquire(0.05)) or sum(len(b.values) for b in blocks) >= samples)
        return blocks


@pytest.fixture(params=WIRES)
def bench(request):
    signals = FakeSignals()
    device = LvdtDevice(signals, CLOCK)
    with served(device, request.param) as (server, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        driver.connect()
        yield Bench(signals, device, server, driver)
        driver.close()


def assert_true(blocks, clock=CLOCK, first=0):
    """Gap-free from ``first`` on, and every value and time as the rig had it."""
    numbers = np.concatenate([block.first + np.arange(len(block.values)) for block in blocks])
    assert np.array_equal(numbers, first + np.arange(len(numbers)))
    times = np.concatenate([block.device_ns for block in blocks])
    values = np.concatenate([block.values for block in blocks])
    begun = (times - clock.offset_ns) / (1 + clock.ppm * 1e-6)
    grid = np.rint(begun / MS).astype(np.int64) * MS
    assert np.abs(begun - grid).max() < 10_000  # a microsecond of the stamp, and the rate error within a block
    assert np.all(np.diff(grid) == MS)
    assert np.abs(values - truth("displacement", grid)).max() <= UNITS["displacement"]


def test_samples_come_whole_in_order_and_with_their_times(bench):
    bench.signals.step(500)
    blocks = bench.collect(500)
    assert_true(blocks)
    assert {block.quality for block in blocks} == {"good"}
    assert bench.driver.health().lost == 0


def test_nothing_comes_where_nothing_new_was_made(bench):
    assert bench.driver.acquire(0.05) == []
    bench.signals.step(3)
    assert sum(len(block.values) for block in bench.collect(3)) == 3


FAULTS = [
    WireFault("drop"),
    WireFault("delay", 2.5 * TIMEOUT),
    WireFault("crc"),
    WireFault("truncate"),
    WireFault("unit"),
    WireFault("exception", 6),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.kind)
def test_a_block_that_did_not_come_is_read_again_without_loss(bench, fault):
    bench.signals.step(40)
    bench.server.inject(fault, times=2, function=23)
    blocks = bench.collect(40)
    bench.signals.step(40)
    assert_true(blocks + bench.collect(40))
    assert bench.server.pending_faults == 0
    assert bench.driver.health().lost == 0
    assert bench.driver.health().words == ""


def test_a_repeated_old_block_is_not_taken_for_the_one_wanted(bench):
    bench.signals.step(30)
    blocks = bench.collect(30)
    bench.signals.step(30)
    bench.server.inject(WireFault("stale"), function=23)
    assert_true(blocks + bench.collect(30))
    assert bench.server.pending_faults == 0
    assert bench.driver.health().lost == 0


def test_what_the_ring_could_not_keep_is_counted(bench):
    bench.signals.step(10_000)
    blocks = bench.collect(4096)
    assert blocks[0].first == bench.driver.health().lost == 10_000 - 4096
    assert_true(blocks, first=10_000 - 4096)


def test_the_device_clock_is_unwrapped():
    signals = FakeSignals()
    clock = DeviceClock(offset_ns=2**32 * 1000 - signals.now_ns() - 50 * MS)
    with served(LvdtDevice(signals, clock), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        driver.connect()
        times = []
        for _ in range(4):
            signals.step(30)
            until(
                lambda: times.extend(t for b in driver.acquire(0.05) for t in b.device_ns) or len(times) % 30 == 0
            )
        driver.close()
    assert np.all(np.diff(times) == MS)


def test_the_age_of_the_newest_sample_is_known():
    signals, bench_ns = FakeSignals(), [0]
    with served(LvdtDevice(signals), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, lambda: bench_ns[0], unit=1, timeout=TIMEOUT)
        driver.connect()
        assert driver.age() is None
        signals.step(20.4)
        until(lambda: bool(driver.acquire(0.05)))
        assert driver.age() == pytest.approx(0.4e-3, abs=2e-6)
        bench_ns[0] += 30 * MS
        assert driver.age() == pytest.approx(30.4e-3, abs=2e-6)
        driver.close()


def test_its_clock_is_read_between_question_and_answer(bench):
    bench.signals.step(20)
    bench.collect(20)
    stamp = bench.driver.stamp
    assert stamp.sent_ns < stamp.received_ns
    assert abs(stamp.device_ns - CLOCK.ns(bench.signals.now_ns())) <= 1000


def test_one_value_can_be_asked_for(bench):
    reading = bench.driver.read("displacement")
    assert reading.value == pytest.approx(truth("displacement", np.array([bench.signals.now_ns()]))[0], abs=1e-7)
    assert reading.value == pytest.approx(reading.raw * 1e-7)
    assert (reading.device_ns, reading.quality) == (CLOCK.ns(bench.signals.now_ns()) // 1000 * 1000, "good")


def test_a_missing_core_is_no_value(bench):
    bench.signals.dead.add("displacement")
    bench.signals.step(5)
    (block,) = bench.collect(5)
    assert np.isnan(block.values).all()
    assert block.quality == bench.driver.read("displacement").quality == "bad"


def test_an_instrument_that_restarts_must_be_connected_again(bench):
    bench.signals.step(5)
    bench.collect(5)
    bench.device.ring.restart()
    with pytest.raises(NotConnected, match=r"restarted \(1 power-ups, now 2\)"):
        until(lambda: bench.driver.acquire(0.05) is None)
    bench.driver.connect()
    bench.signals.step(5)
    assert bench.collect(5)[0].first == 0


def test_a_silence_that_lasts_is_no_longer_connected(bench):
    bench.server.silent = True
    with pytest.raises(NotConnected, match="no good block for"):
        until(lambda: bench.driver.acquire(0.05) is None)
    assert "0." in bench.driver.health().words
    bench.server.silent = False
    until(lambda: _connects(bench.driver))
    bench.signals.step(5)
    assert bench.collect(5)[0].first == 0


def _connects(driver):
    try:
        driver.connect()
    except DriverError:
        return False
    return True


def test_another_instrument_is_not_taken_for_a_conditioner():
    with served(ThermometerDevice(FakeSignals()), "tcp") as (_, address):
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=TIMEOUT)
        with pytest.raises(BadReply, match="answers as 0x5448, a lvdt as 0x4c56"):
            driver.connect()
        assert not driver.health().connected


def test_a_serial_line_that_is_too_slow_is_refused_before_it_is_opened():
    with pytest.raises(OutOfRange, match="38400 baud carry"):
        Lvdt("lvdt", ModbusAddress("/dev/ttyUSB0", 38400), time.monotonic_ns)


def test_it_cannot_be_set_and_has_one_channel(bench):
    assert [(c.name, c.unit, c.access) for c in bench.driver.channels] == [("displacement", "m", "read")]
    with pytest.raises(OutOfRange, match="only measures"):
        bench.driver.write("displacement", 0.0)
    with pytest.raises(OutOfRange, match="no channel 'force'"):
        bench.driver.read("force")
    bench.driver.make_safe()


def test_at_its_stated_baud_rate_the_line_keeps_up():
    """Time runs on the wall here: 1000 samples a second, and an answer takes as long as its bytes do."""
    signals = FakeSignals(0)
    begun = time.monotonic_ns()
    signals.now_ns = lambda: time.monotonic_ns() - begun + 5_000 * MS
    with served(LvdtDevice(signals), "rtu over pty") as (server, address):
        server.baud = 115200
        driver = Lvdt("lvdt", address, time.monotonic_ns, unit=1, timeout=0.3)
        driver.connect()
        blocks = []
        until(lambda: blocks.extend(driver.acquire(0.1)) or sum(len(b.values) for b in blocks) >= 1000, 20)
        driver.close()
    assert_true(blocks, DeviceClock())
