"""Every instrument's samples on the bench clock, against the clocks that the simulated rig knows."""

import gc
import multiprocessing
import os
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from can_rig import wait_until

from bench.rig.acquisition import Acquisition, Batch
from bench.rig.alignment import Aligner
from drivers.actuator import Actuator
from drivers.can_bus import CanAddress
from drivers.coil_amplifier import CoilAmplifier
from drivers.errors import DriverError
from drivers.load_cell import LoadCell
from drivers.lvdt import Lvdt
from drivers.modbus_address import ModbusAddress
from drivers.thermometer import Thermometer
from sim_rig.clock import RunningClock
from sim_rig.scenario import load_scenario
from sim_rig.serve import ServedRig

pytestmark = pytest.mark.timeout(120)
BAR = 0.2e-3
"""[s] of skew between channels, in 95 of 100 samples."""

SETTLED = 3.0
"""[s] after which the clocks are known; a run begins later."""


def built(wires):
    """The drivers that reach the wires of a rig."""
    clock = time.monotonic_ns
    found = {}
    for wire in wires:
        section = wire.settings
        url = str(section.get("url", ""))
        match wire.instrument:
            case "load_cell":
                found["load_cell"] = LoadCell("load_cell", url, clock)
            case "lvdt":
                found["lvdt"] = Lvdt("lvdt", ModbusAddress(url), clock, unit=section["unit"])
            case "thermometer":
                found["thermometer"] = Thermometer("thermometer", ModbusAddress(url), clock, unit=section["unit"])
            case "coil_amplifier":
                address = ModbusAddress(url)
                found["coil_amplifier"] = CoilAmplifier("coil_amplifier", address, clock, unit=section["unit"])
            case "actuator":
                address = CanAddress("socketcand", port=section["port"])
                found["actuator"] = Actuator("actuator", address, clock, clamped=True)
    return found


@contextmanager
def connected(instruments):
    try:
        for instrument in instruments.values():
            instrument.connect()
        yield instruments
    finally:
        for instrument in instruments.values():
            instrument.close()


def serve(pipe):
    """The rig in a process of its own, as `mrbench sim` runs it; tells its wires and its clocks."""
    sys.setswitchinterval(5e-4)
    clock = RunningClock()
    began = time.monotonic_ns() - clock.now_ns()
    with ServedRig(load_scenario("default"), clock) as served:
        gc.collect()
        gc.freeze()
        pipe.send((served.wires, served.clocks, began))
        pipe.recv()


@contextmanager
def rig():
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(theirs,), daemon=True)
    process.start()
    try:
        assert ours.poll(60)
        yield ours.recv()
    finally:
        ours.send("end")
        process.join(10)
        process.kill()


def recorded(seconds):
    """Batches, bench samples and the error of each mapped instant [ns] by instrument, over some seconds."""
    batches: list[Batch] = []
    errors: list[tuple[str, DriverError]] = []
    with rig() as (wires, clocks, began), connected(built(wires)) as instruments:
        acquisition = Acquisition(
            instruments,
            lambda batch: (batches.append(batch), aligner.feed(batch)),
            lambda name, error: errors.append((name, error)),
            idle={"actuator": instruments["actuator"]},
        )
        aligner = Aligner(acquisition.maps, "coil_voltage")
        aligned, skews = [], {name: [] for name in instruments}
        acquisition.start()
        end = time.monotonic() + seconds

        def over():
            if (ready := aligner.ready()) is not None:
                aligned.append(ready)
            for name, made in acquisition.maps.items():
                if made.known:
                    skews[name].append(made.skew())
            time.sleep(0.025)
            return time.monotonic() > end

        wait_until(over, seconds + 5)
        assert acquisition.stop() == ()
        left = {}
        for name in instruments:
            mine = [b for batch in batches if batch.instrument == name for b in batch.blocks]
            device = np.concatenate([block.device_ns for block in mine if block.channel == mine[0].channel])
            device = device[device > device[0] + SETTLED * 1e9]
            own = clocks[name]
            truth = began + (device - own.offset_ns) / (1 + own.ppm * 1e-6)
            left[name] = acquisition.maps[name].bench_ns(device) - truth
    return left, aligned, aligner.lost, skews, errors


def shown(left, skews):
    for name, error in left.items():
        size = np.abs(error) / 1e3
        quantiles = " ".join(f"p{q} {np.percentile(size, q):.0f}" for q in (50, 95, 99, 100))
        bound = np.median(skews[name]) * 1e6
        sys.stdout.write(f"{name:15} {len(error):6} samples  {quantiles} us  bound {bound:.0f} us\n")


def between(left):
    """Largest difference between the clocks' errors by percentile, of random pairs of samples [s]."""
    random = np.random.default_rng(1)
    fast = [name for name in left if name != "thermometer"]
    drawn = np.stack([random.choice(left[name], 20_000) for name in fast])
    return (drawn.max(axis=0) - drawn.min(axis=0)) * 1e-9


def check(seconds):
    left, aligned, lost, skews, errors = recorded(seconds)
    shown(left, skews)
    skew = between(left)
    p50, p95 = np.percentile(skew, [50, 95]) * 1e6
    sys.stdout.write(f"between any two: p50 {p50:.0f} p95 {p95:.0f} us; lost {lost}\n")
    assert not errors
    assert np.percentile(skew, 95) <= BAR
    time_ns = np.concatenate([part.time_ns for part in aligned])
    assert np.all(np.diff(time_ns) > 0)
    assert len(time_ns) >= 900 * (seconds - 2)
    return left, skews


def test_channels_are_within_a_fifth_of_a_millisecond_of_each_other():
    check(8.0)


def busy():
    """At the lowest priority, as fits are."""
    os.nice(19)
    while True:
        sum(range(10_000))


@pytest.mark.slow
def test_they_are_beside_two_busy_processes():
    load = [multiprocessing.get_context("spawn").Process(target=busy, daemon=True) for _ in range(2)]
    for process in load:
        process.start()
    try:
        check(12.0)
    finally:
        for process in load:
            process.terminate()
            process.join()
