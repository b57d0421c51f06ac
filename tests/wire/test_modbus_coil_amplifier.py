"""The coil amplifier: driver against simulated instrument."""

import threading
import time

import numpy as np
import pytest
from modbus_bench import MS, TIMEOUT, UNITS, WIRES, FakeSignals, served, truth, until

from drivers.coil_amplifier import CoilAmplifier, CoilFault, CoilState
from drivers.coil_table import TableState
from drivers.errors import BadReply, DriverError, NoReply, NotConnected, OutOfRange, Refused
from sim_rig.device_clock import DeviceClock
from sim_rig.modbus_coil_amplifier import CoilAmplifierDevice
from sim_rig.modbus_server import WireFault

pytestmark = pytest.mark.timeout(60)
CLOCK = DeviceClock(offset_ns=9_000_000_000, ppm=120.0)
RAMP = 10.0


class Bench:
    """An amplifier on its wire and its driver, connected."""

    def __init__(self, signals, device, server, driver):
        self.signals, self.device, self.server, self.driver = signals, device, server, driver

    def step(self, milliseconds):
        """Let the rig's time pass, spoken to every 10 ms as an agent would."""
        for _ in range(int(milliseconds // 10)):
            self.signals.step(10)
            self.device.advance()
            self.driver.condition()

    @property
    def output(self):
        return self.driver.read("coil_drive").value


def amplifier(address, **settings):
    return CoilAmplifier("amplifier", address, time.monotonic_ns, timeout=TIMEOUT, ramp=RAMP, **settings)


def made(wire):
    signals = FakeSignals()
    device = CoilAmplifierDevice(signals, CLOCK)
    with served(device, wire, unit=2) as (server, address):
        driver = amplifier(address)
        driver.connect()
        yield Bench(signals, device, server, driver)
        driver.close()


@pytest.fixture(params=WIRES)
def every_wire(request):
    yield from made(request.param)


@pytest.fixture
def bench():
    yield from made("tcp")


def test_voltage_and_current_come_side_by_side(every_wire):
    bench = every_wire
    bench.signals.step(200)
    blocks = []
    until(lambda: blocks.extend(bench.driver.acquire(0.05)) or sum(len(b.values) for b in blocks) >= 400)
    for channel in ("coil_voltage", "coil_current"):
        own = [block for block in blocks if block.channel == channel]
        times = np.concatenate([block.device_ns for block in own])
        grid = np.rint((times - CLOCK.offset_ns) / (1 + CLOCK.ppm * 1e-6) / MS).astype(np.int64) * MS
        assert np.all(np.diff(grid) == MS)
        values = np.concatenate([block.values for block in own])
        assert np.abs(values - truth(channel, grid)).max() <= UNITS[channel]
    assert bench.driver.health().lost == 0


def test_the_output_goes_to_its_setpoint_by_the_ramp(every_wire):
    bench = every_wire
    bench.driver.write("coil_drive", 2.0)
    bench.signals.step(100)
    assert bench.output == pytest.approx(1.0)
    assert bench.driver.condition().state == CoilState.OUTPUT_ON | CoilState.RAMPING
    bench.step(200)
    assert bench.output == 2.0
    assert bench.signals.drive == 2.0
    assert bench.driver.condition().state == CoilState.OUTPUT_ON


def test_a_step_table_runs_exactly_by_the_amplifiers_own_clock(every_wire):
    bench = every_wire
    times, levels = np.arange(200) * 0.010, np.tile([0.5, -0.25, 1.5, 0.0], 50)
    bench.driver.upload(times, levels)
    bench.driver.arm()
    assert bench.driver.table().state is TableState.ARMED
    bench.step(50)
    assert bench.output == 0.0
    bench.device.trigger(bench.signals.now_ns())
    begun = bench.signals.now_ns()
    assert bench.driver.table() == (TableState.RUNNING, CLOCK.ns(begun) // 1000 * 1000)
    for place in range(150):
        bench.signals.step(10)
        bench.device.advance()
        assert bench.signals.drive == levels[place + 1]
        if place % 20 == 0:
            bench.driver.condition()
    bench.step(1000)
    assert bench.driver.table().state is TableState.DONE
    assert bench.output == levels[-1]


def test_a_running_table_keeps_its_output_to_itself_until_it_is_aborted(bench):
    bench.driver.upload(np.array([0.0, 1.0]), np.array([0.5, 2.0]))
    bench.driver.arm()
    bench.device.trigger(bench.signals.now_ns())
    bench.step(100)
    assert bench.output == 0.5
    with pytest.raises(Refused, match="its table is running; reset it, or abort the table"):
        bench.driver.write("coil_drive", 0.1)
    with pytest.raises(Refused, match="present state"):
        bench.driver.upload(np.array([0.0]), np.array([0.1]))
    bench.driver.abort_table()
    bench.step(1500)
    assert bench.output == 0.5
    assert bench.driver.table() == (TableState.IDLE, None)


@pytest.mark.parametrize(
    ("times", "levels", "words"),
    [
        ([0.0, 0.1, 0.1], [0.0, 0.1, 0.2], "must rise"),
        ([-0.1], [0.0], "must rise"),
        ([0.0, 5000.0], [0.0, 1.0], "must rise"),
        ([0.0], [25.0], "lies outside -24 to 24 V"),
        ([0.0], [float("nan")], "lies outside"),
        ([], [], "holds 1 to 1024"),
        ([0.0, 1.0], [0.0], "2 times and 1 levels"),
    ],
)
def test_a_table_that_cannot_be_run_is_not_sent(bench, times, levels, words):
    answered = bench.driver.health().received
    with pytest.raises(OutOfRange, match=words):
        bench.driver.upload(np.array(times), np.array(levels))
    assert bench.driver.health().received == answered


def test_a_table_that_reads_back_differently_is_an_error(bench):
    def forget():
        bench.device._table[1] ^= 1
        return bench.device._table

    bench.device._bank.sections[1].read = forget
    with pytest.raises(BadReply, match="does not read as written"):
        bench.driver.upload(np.array([0.0]), np.array([0.1]))


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("over_temperature", CoilFault.OVER_TEMPERATURE),
        ("open_coil", CoilFault.OPEN_COIL),
        ("over_current", CoilFault.OVER_CURRENT),
    ],
)
def test_a_fault_takes_the_output_away_until_it_is_reset(bench, name, fault):
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    bench.device.fail(name)
    assert bench.signals.drive == 0.0
    bench.signals.step(10)
    until(lambda: bool(bench.driver.acquire(0.05)))
    assert bench.driver.faults == bench.driver.condition().fault == fault
    words = name.replace("_", " ")
    assert bench.driver.health().words == words
    with pytest.raises(Refused, match=words):
        bench.driver.write("coil_drive", 1.0)
    with pytest.raises(Refused, match=f"after a reset still: {words}"):
        bench.driver.reset()
    bench.device.heal()
    bench.driver.reset()
    bench.driver.write("coil_drive", 1.0)
    bench.step(300)
    assert bench.output == 1.0


def test_when_nobody_speaks_the_output_ramps_to_zero_by_itself(every_wire):
    bench = every_wire
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    bench.signals.step(499)
    assert bench.device.advance() == 2.0
    bench.signals.step(101)
    assert bench.device.advance() == pytest.approx(1.0, abs=1e-6)
    bench.signals.step(200)
    until(lambda: bench.signals.drive == 0.0)
    assert bench.driver.condition().state == CoilState.OUTPUT_ON | CoilState.WATCHDOG_TRIPPED
    with pytest.raises(Refused, match="watchdog tripped"):
        bench.driver.write("coil_drive", 1.0)
    bench.driver.reset()
    bench.driver.write("coil_drive", 1.0)
    bench.step(200)
    assert bench.output == 1.0


def test_the_watchdog_stops_a_running_table(bench):
    bench.driver.upload(np.array([0.0, 5.0]), np.array([1.0, 2.0]))
    bench.driver.arm()
    bench.device.trigger(bench.signals.now_ns())
    bench.signals.step(1000)
    assert bench.device.advance() == 0.0
    bench.signals.step(6000)
    assert bench.device.advance() == 0.0
    assert bench.driver.table().state is TableState.IDLE


def test_reading_samples_alone_feeds_the_watchdog(bench):
    bench.driver.write("coil_drive", 1.0)
    for _ in range(10):
        bench.signals.step(200)
        until(lambda: bool(bench.driver.acquire(0.05)))
    assert bench.output == 1.0


def test_safe_is_zero_even_out_of_a_running_table(every_wire):
    bench = every_wire
    bench.driver.upload(np.array([0.0, 1.0]), np.array([0.5, 2.0]))
    bench.driver.arm()
    bench.device.trigger(bench.signals.now_ns())
    bench.server.inject(WireFault("drop"))
    bench.driver.make_safe()
    bench.step(300)
    assert bench.output == 0.0
    assert bench.driver.table().state is TableState.IDLE


def test_making_safe_over_a_dead_wire_raises_nothing(every_wire):
    bench = every_wire
    bench.server.silent = True
    bench.driver.make_safe()
    bench.driver.close()
    bench.driver.close()
    bench.driver.make_safe()


def test_an_unconfirmed_setpoint_is_an_error(every_wire):
    bench = every_wire
    bench.server.inject(WireFault("drop"), function=16)
    with pytest.raises(NoReply, match="amplifier: writing 2 registers at 3"):
        bench.driver.write("coil_drive", 1.0)


def test_a_drive_out_of_range_is_not_sent(bench):
    with pytest.raises(OutOfRange, match=r"coil_drive: 24\.1 V lies outside -24 to 24 V; nothing was sent"):
        bench.driver.write("coil_drive", 24.1)
    with pytest.raises(OutOfRange, match="is measured"):
        bench.driver.write("coil_current", 1.0)
    assert bench.output == 0.0


@pytest.mark.parametrize("setting", [{"ramp": 0.0}, {"watchdog": 0.01}, {"watchdog": 60.0}])
def test_a_setting_out_of_range_is_refused_before_anything_is_opened(bench, setting):
    with pytest.raises(OutOfRange, match=next(iter(setting))):
        CoilAmplifier("amplifier", bench.driver.address, time.monotonic_ns, **setting)


def test_channels_have_the_unit_of_the_mode(bench):
    assert [(c.name, c.unit, c.access) for c in bench.driver.channels] == [
        ("coil_voltage", "V", "read"),
        ("coil_current", "A", "read"),
        ("coil_drive", "V", "read_write"),
    ]
    current = amplifier(bench.driver.address, mode="current")
    assert (current.channels[2].unit, current.channels[2].high) == ("A", 3.0)


def test_a_mode_that_it_does_not_have_is_refused_at_once():
    with served(CoilAmplifierDevice(FakeSignals(), drive_unit="A"), "tcp", unit=2) as (_, address):
        driver = amplifier(address, mode="voltage")
        with pytest.raises(Refused, match="does not take this value"):
            driver.connect()
        assert not driver.health().connected


def test_connecting_brings_an_output_that_was_left_on_to_zero(bench):
    bench.driver.write("coil_drive", 2.0)
    bench.step(300)
    other = amplifier(bench.driver.address)
    moving = threading.Event()

    def pass_time():
        while not moving.wait(0.002):
            bench.signals.step(10)

    thread = threading.Thread(target=pass_time)
    thread.start()
    try:
        other.connect()
    finally:
        moving.set()
        thread.join()
    assert other.condition().output == 0.0
    other.close()


def test_an_amplifier_that_was_switched_off_must_be_connected_again(bench):
    bench.driver.write("coil_drive", 1.0)
    bench.device.restart()
    assert bench.signals.drive == 0.0
    with pytest.raises(Refused, match="present state"):
        bench.driver.write("coil_drive", 1.0)
    with pytest.raises(NotConnected, match="restarted"):
        until(lambda: bench.driver.acquire(0.05) is None)
    bench.driver.connect()
    bench.driver.write("coil_drive", 1.0)
    bench.step(200)
    assert bench.output == 1.0


def test_random_trouble_never_gives_a_wrong_sample_or_a_wrong_level(every_wire):
    bench = every_wire
    chance = np.random.default_rng(3)
    kinds = ["drop", "crc", "truncate", "unit", "delay", "stale", "garbage"]
    asked = 0.0
    for attempt in range(30):
        bench.signals.step(20)
        if attempt % 2 and not bench.server.pending_faults:
            bench.server.inject(WireFault(str(chance.choice(kinds)), 1.4 * TIMEOUT))
        if chance.random() < 0.3:
            level = round(float(chance.uniform(0, 1)), 3)
            try:
                bench.driver.write("coil_drive", level)
                asked = level
            except DriverError:
                asked = None
        for block in bench.driver.acquire(0.02):
            grid = np.rint((block.device_ns - CLOCK.offset_ns) / (1 + CLOCK.ppm * 1e-6) / MS).astype(np.int64) * MS
            assert np.abs(block.values - truth(block.channel, grid)).max() <= UNITS[block.channel]
        if asked is not None:
            assert bench.device.output.target == pytest.approx(asked)
    assert bench.driver.health().lost == 0
