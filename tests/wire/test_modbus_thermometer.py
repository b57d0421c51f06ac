"""The thermometer: driver and simulated instrument, over every wire."""

import time

import numpy as np
import pytest

from drivers.errors import OutOfRangeError
from drivers.modbus.thermometer import Thermometer
from sim_rig.instruments.modbus_sensor import SensorDevice
from sim_rig.protocols.modbus_server import ReplyFault
from tests.support.modbus_bench import TIMEOUT, WIRES, FakeSignals, serve, truth, wait_until

pytestmark = pytest.mark.timeout(60)


@pytest.fixture(params=WIRES)
def bench(request):
    signals = FakeSignals()
    with serve(SensorDevice("thermometer", signals), request.param, unit=3) as (server, address):
        driver = Thermometer("thermometer", address, time.monotonic_ns, timeout=TIMEOUT)
        driver.connect()
        yield signals, server, driver
        driver.close()


@pytest.mark.parametrize("fault", [None, ReplyFault("drop"), ReplyFault("crc")], ids=str)
def test_there_are_ten_temperatures_per_second(bench, fault):
    signals, server, driver = bench
    signals.step(2_000)
    if fault:
        server.inject(fault, function=23)
    blocks = []
    wait_until(lambda: blocks.extend(driver.acquire(0.05)) or sum(len(b.values) for b in blocks) >= 20)
    assert server.pending_faults == 0
    times = np.concatenate([block.device_ns for block in blocks])
    values = np.concatenate([block.values for block in blocks])
    assert np.all(np.diff(times) == 100_000_000)
    assert values == pytest.approx(truth("temperature", times), abs=0.005 + 1e-9)
    assert driver.get_health().lost == 0


def test_the_temperature_can_be_requested(bench):
    signals, _, driver = bench
    assert driver.read("temperature").value == pytest.approx(27.0)
    assert driver.read("temperature").quality == "good"
    signals.dead.add("temperature")
    assert driver.read("temperature").quality == "bad"


def test_a_temperature_out_of_range_is_uncertain(bench):
    signals, _, driver = bench
    signals.step(240_000)
    assert driver.read("temperature").quality == "uncertain"


def test_it_only_measures(bench):
    _, _, driver = bench
    assert [(c.name, c.unit) for c in driver.channels] == [("temperature", "degC")]
    assert driver.compute_age() is None
    driver.make_safe()
    with pytest.raises(OutOfRangeError, match="only measures"):
        driver.write("temperature", 20.0)
