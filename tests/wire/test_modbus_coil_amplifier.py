"""The coil amplifier: driver and simulated instrument."""

import threading
import time

import numpy as np
import pytest

from drivers.errors import (
    DriverError,
    InvalidReplyError,
    NoReplyError,
    NotConnectedError,
    OutOfRangeError,
    RefusedError,
)
from drivers.modbus.coil_amplifier import CoilAmplifier, CoilFault, CoilState
from drivers.modbus.step_table import TableState
from sim_rig.instruments.coil_amplifier import CoilAmplifierDevice
from sim_rig.live.device_clock import DeviceClock
from sim_rig.protocols.modbus_server import ReplyFault
from tests.support.modbus_bench import MS, RESOLUTION, TIMEOUT, WIRES, FakeSignals, serve, truth, wait_until

pytestmark = pytest.mark.timeout(60)
CLOCK = DeviceClock(offset_ns=9_000_000_000, ppm=120.0)
RAMP = 10.0


class Bench:
    """Amplifier on its wire, and its connected driver."""

    def __init__(self, signals, device, server, driver):
        self.signals, self.device, self.server, self.driver = signals, device, server, driver

    def step(self, milliseconds):
        """Advance the rig's clock with a request every 10 ms, as an agent sends them."""
        for _ in range(int(milliseconds // 10)):
            self.signals.step(10)
            self.device.advance()
            self.driver.read_status()

    @property
    def output(self):
        return self.driver.read("coil_drive").value


def amplifier(address, **settings):
    return CoilAmplifier("amplifier", address, time.monotonic_ns, timeout=TIMEOUT, ramp=RAMP, **settings)


def make_bench(wire):
    signals = FakeSignals()
    device = CoilAmplifierDevice(signals, CLOCK)
    with serve(device, wire, unit=2) as (server, address):
        driver = amplifier(address)
        driver.connect()
        yield Bench(signals, device, server, driver)
        driver.close()


@pytest.fixture(params=WIRES)
def every_wire(request):
    yield from make_bench(request.param)


@pytest.fixture
def bench():
    yield from make_bench("tcp")


def test_voltage_and_current_have_the_same_times(every_wire):
    bench = every_wire
    bench.signals.step(200)
    blocks = []
    wait_until(lambda: blocks.extend(bench.driver.acquire(0.05)) or sum(len(b.values) for b in blocks) >= 400)
    for channel in ("coil_voltage", "coil_current"):
        own = [block for block in blocks if block.channel == channel]
        times = np.concatenate([block.device_ns for block in own])
        grid = np.rint((times - CLOCK.offset_ns) / (1 + CLOCK.ppm * 1e-6) / MS).astype(np.int64) * MS
        assert np.all(np.diff(grid) == MS)
        values = np.concatenate([block.values for block in own])
        assert np.abs(values - truth(channel, grid)).max() <= RESOLUTION[channel]
    assert bench.driver.get_health().lost == 0


def test_the_output_follows_its_setpoint_by_the_ramp(every_wire):
    bench = every_wire
    bench.driver.write("coil_drive", 2.0)
    bench.signals.step(100)
    assert bench.output == pytest.approx(1.0)
    assert bench.driver.read_status().state == CoilState.OUTPUT_ON | CoilState.RAMPING
    bench.step(200)
    assert bench.output == 2.0
    assert bench.signals.drive == 2.0
    assert bench.driver.read_status().state == CoilState.OUTPUT_ON


def test_a_step_table_is_played_exactly_by_the_amplifiers_own_clock(every_wire):
    bench = every_wire
    times, levels = np.arange(200) * 0.010, np.tile([0.5, -0.25, 1.5, 0.0], 50)
    bench.driver.upload_table(times, levels)
    bench.driver.arm_table()
    assert bench.driver.read_table_progress().state is TableState.ARMED
    bench.step(50)
    assert bench.output == 0.0
    bench.device.trigger(bench.signals.now_ns())
    trigger_ns = bench.signals.now_ns()
    assert bench.driver.read_table_progress() == (TableState.RUNNING, CLOCK.read_ns(trigger_ns) // 1000 * 1000)
    for step in range(150):
        bench.signals.step(10)
        bench.device.advance()
        assert bench.signals.drive == levels[step + 1]
        if step % 20 == 0:
            bench.driver.read_status()
    bench.step(1000)
    assert bench.driver.read_table_progress().state is TableState.DONE
    assert bench.output == levels[-1]


def test_while_a_table_runs_setpoints_are_refused_until_it_is_aborted(bench):
    bench.driver.upload_table(np.array([0.0, 1.0]), np.array([0.5, 2.0]))
    bench.driver.arm_table()
    bench.device.trigger(bench.signals.now_ns())
    bench.step(100)
    assert bench.output == 0.5
    with pytest.raises(RefusedError, match="its table is running; reset it, or abort the table"):
        bench.driver.write("coil_drive", 0.1)
    with pytest.raises(RefusedError, match="present state"):
        bench.driver.upload_table(np.array([0.0]), np.array([0.1]))
    bench.driver.abort_table()
    bench.step(1500)
    assert bench.output == 0.5
    assert bench.driver.read_table_progress() == (TableState.IDLE, None)


@pytest.mark.parametrize(
    ("times", "levels", "message"),
    [
        ([0.0, 0.1, 0.1], [0.0, 0.1, 0.2], "must rise"),
        ([-0.1], [0.0], "must rise"),
        ([0.0, 5000.0], [0.0, 1.0], "must rise"),
        ([0.0], [25.0], "is outside -24 to 24 V"),
        ([0.0], [float("nan")], "is outside"),
        ([], [], "holds 1 to 1024"),
        ([0.0, 1.0], [0.0], "2 times and 1 levels do not match"),
    ],
)
def test_an_invalid_table_is_not_sent(bench, times, levels, message):
    received = bench.driver.get_health().received
    with pytest.raises(OutOfRangeError, match=message):
        bench.driver.upload_table(np.array(times), np.array(levels))
    assert bench.driver.get_health().received == received


def test_a_table_that_reads_back_differently_is_an_error(bench):
    def read_with_error():
        bench.device._table[1] ^= 1
        return bench.device._table

    bench.device._bank.sections[1].read = read_with_error
    with pytest.raises(InvalidReplyError, match="reads back other values than were written"):
        bench.driver.upload_table(np.array([0.0]), np.array([0.1]))


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("over_temperature", CoilFault.OVER_TEMPERATURE),
        ("open_coil", CoilFault.OPEN_COIL),
        ("over_current", CoilFault.OVER_CURRENT),
    ],
)
def test_a_fault_switches_the_output_to_zero_until_a_reset(bench, name, fault):
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    bench.device.inject_fault(name)
    assert bench.signals.drive == 0.0
    bench.signals.step(10)
    wait_until(lambda: bool(bench.driver.acquire(0.05)))
    assert bench.driver.faults == bench.driver.read_status().fault == fault
    message = name.replace("_", " ")
    assert bench.driver.get_health().message == message
    with pytest.raises(RefusedError, match=message):
        bench.driver.write("coil_drive", 1.0)
    with pytest.raises(RefusedError, match=f"the fault remains after a reset: {message}"):
        bench.driver.reset()
    bench.device.remove_fault_causes()
    bench.driver.reset()
    bench.driver.write("coil_drive", 1.0)
    bench.step(300)
    assert bench.output == 1.0


def test_without_requests_the_output_ramps_to_zero_by_itself(every_wire):
    bench = every_wire
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    bench.signals.step(499)
    assert bench.device.advance() == 2.0
    bench.signals.step(101)
    assert bench.device.advance() == pytest.approx(1.0, abs=1e-6)
    bench.signals.step(200)
    wait_until(lambda: bench.signals.drive == 0.0)
    assert bench.driver.read_status().state == CoilState.OUTPUT_ON | CoilState.WATCHDOG_TRIPPED
    with pytest.raises(RefusedError, match="watchdog tripped"):
        bench.driver.write("coil_drive", 1.0)
    bench.driver.reset()
    bench.driver.write("coil_drive", 1.0)
    bench.step(200)
    assert bench.output == 1.0


def test_the_watchdog_stops_a_running_table(bench):
    bench.driver.upload_table(np.array([0.0, 5.0]), np.array([1.0, 2.0]))
    bench.driver.arm_table()
    bench.device.trigger(bench.signals.now_ns())
    bench.signals.step(1000)
    assert bench.device.advance() == 0.0
    bench.signals.step(6000)
    assert bench.device.advance() == 0.0
    assert bench.driver.read_table_progress().state is TableState.IDLE


def test_reading_samples_alone_restarts_the_watchdog(bench):
    bench.driver.write("coil_drive", 1.0)
    for _ in range(10):
        bench.signals.step(200)
        wait_until(lambda: bool(bench.driver.acquire(0.05)))
    assert bench.output == 1.0


def test_make_safe_ends_at_zero_even_from_a_running_table(every_wire):
    bench = every_wire
    bench.driver.upload_table(np.array([0.0, 1.0]), np.array([0.5, 2.0]))
    bench.driver.arm_table()
    bench.device.trigger(bench.signals.now_ns())
    bench.server.inject(ReplyFault("drop"))
    bench.driver.make_safe()
    bench.step(300)
    assert bench.output == 0.0
    assert bench.driver.read_table_progress().state is TableState.IDLE


def test_make_safe_over_a_dead_wire_raises_nothing(every_wire):
    bench = every_wire
    bench.server.silent = True
    assert "amplifier" in bench.driver.make_safe()
    bench.driver.close()
    bench.driver.close()
    bench.driver.make_safe()


def test_an_unconfirmed_setpoint_is_an_error(every_wire):
    bench = every_wire
    bench.server.inject(ReplyFault("drop"), function=16)
    with pytest.raises(NoReplyError, match="amplifier: writing 2 registers at 3"):
        bench.driver.write("coil_drive", 1.0)


def test_a_drive_out_of_range_is_not_sent(bench):
    with pytest.raises(OutOfRangeError, match=r"coil_drive: 24\.1 V is outside -24 to 24 V; nothing was sent"):
        bench.driver.write("coil_drive", 24.1)
    with pytest.raises(OutOfRangeError, match="is measured"):
        bench.driver.write("coil_current", 1.0)
    assert bench.output == 0.0


@pytest.mark.parametrize("setting", [{"ramp": 0.0}, {"watchdog": 0.01}, {"watchdog": 60.0}])
def test_a_setting_out_of_range_is_refused_before_anything_is_opened(bench, setting):
    with pytest.raises(OutOfRangeError, match=next(iter(setting))):
        CoilAmplifier("amplifier", bench.driver.address, time.monotonic_ns, **setting)


def test_channels_have_the_unit_of_the_mode(bench):
    assert [(c.name, c.unit, c.access) for c in bench.driver.channels] == [
        ("coil_voltage", "V", "read"),
        ("coil_current", "A", "read"),
        ("coil_drive", "V", "read_write"),
    ]
    current = amplifier(bench.driver.address, mode="current")
    assert (current.channels[2].unit, current.channels[2].high) == ("A", 3.0)


def test_an_unavailable_mode_is_refused_while_connecting():
    with serve(CoilAmplifierDevice(FakeSignals(), drive_unit="A"), "tcp", unit=2) as (_, address):
        driver = amplifier(address, mode="voltage")
        with pytest.raises(RefusedError, match="does not accept this value"):
            driver.connect()
        assert not driver.get_health().connected


def test_connecting_brings_an_output_that_was_left_on_to_zero(bench):
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    other = amplifier(bench.driver.address)
    connected = threading.Event()

    def pass_time():
        while not connected.wait(0.002):
            bench.signals.step(10)

    thread = threading.Thread(target=pass_time)
    thread.start()
    try:
        other.connect()
    finally:
        connected.set()
        thread.join()
    assert other.read_status().output == 0.0
    other.close()


def test_an_amplifier_that_was_switched_off_must_be_connected_again(bench):
    bench.driver.write("coil_drive", 1.0)
    bench.device.restart()
    assert bench.signals.drive == 0.0
    with pytest.raises(RefusedError, match="present state"):
        bench.driver.write("coil_drive", 1.0)
    with pytest.raises(NotConnectedError, match="restarted"):
        wait_until(lambda: bench.driver.acquire(0.05) is None)
    bench.driver.connect()
    bench.driver.write("coil_drive", 1.0)
    bench.step(200)
    assert bench.output == 1.0


def test_random_faults_never_give_a_wrong_sample_or_a_wrong_level(every_wire):
    bench = every_wire
    chance = np.random.default_rng(3)
    kinds = ["drop", "crc", "truncate", "unit", "delay", "stale", "garbage"]
    requested = 0.0
    for attempt in range(30):
        bench.signals.step(20)
        if attempt % 2 and not bench.server.pending_faults:
            bench.server.inject(ReplyFault(str(chance.choice(kinds)), 1.4 * TIMEOUT))
        if chance.random() < 0.3:
            level = round(float(chance.uniform(0, 1)), 3)
            try:
                bench.driver.write("coil_drive", level)
                requested = level
            except DriverError:
                requested = None
        for block in bench.driver.acquire(0.02):
            grid = np.rint((block.device_ns - CLOCK.offset_ns) / (1 + CLOCK.ppm * 1e-6) / MS).astype(np.int64) * MS
            assert np.abs(block.values - truth(block.channel, grid)).max() <= RESOLUTION[block.channel]
        if requested is not None:
            assert bench.device.output.target == pytest.approx(requested)
    assert bench.driver.get_health().lost == 0
