"""Alignment of channels with different rates and delays to the force."""

import numpy as np
import pytest

from bench.rig.acquisition import Batch
from bench.rig.alignment import Aligner
from drivers.channel import SampleBlock
from tests.support.fake_rig import FakeClockMap

MS = 1_000_000
BEGIN = 1_000_000_000_000
OFFSETS = {"load_cell": 0, "lvdt": 300_000, "coil_amplifier": 700_000, "actuator": 150_000, "thermometer": 0}
CHANNELS = {
    "force": ("load_cell", 1),
    "displacement": ("lvdt", 1),
    "coil_voltage": ("coil_amplifier", 1),
    "actuator_position": ("actuator", 4),
    "temperature": ("thermometer", 100),
}


def truth(channel, time_ns):
    t = (np.asarray(time_ns) - BEGIN) * 1e-9
    return {
        "force": 100 * np.sin(2 * np.pi * 3 * t),
        "displacement": 0.02 * np.sin(2 * np.pi * 2 * t),
        "velocity": 0.08 * np.pi * np.cos(2 * np.pi * 2 * t),
        "coil_voltage": 0.5 + 2 * t,
        "actuator_position": 0.02 * np.sin(2 * np.pi * 2 * t),
        "temperature": 20 + np.floor(t * 10),
    }[channel]


def block(channel, first, count, quality="good"):
    instrument, period = CHANNELS[channel]
    device = (first + np.arange(count)) * period * MS + OFFSETS[instrument]
    values = truth(channel, device + BEGIN)
    return Batch(instrument, (SampleBlock(channel, first, device, 0, values, values, quality),))


@pytest.fixture
def aligner():
    return Aligner(dict.fromkeys(OFFSETS, FakeClockMap(BEGIN)), "coil_voltage")


def feed(aligner, milliseconds, skip=(), start=0):
    for begin in range(start, milliseconds, 20):
        for channel, (_, period) in CHANNELS.items():
            if channel not in skip and begin % period in range(0, 20) and (20 // period or begin % period == 0):
                aligner.feed(block(channel, begin // period, max(20 // period, 1)))


def collect(aligner):
    parts = list(iter(aligner.align, None))
    return np.concatenate([p.time_ns for p in parts]), {
        name: np.concatenate([p.columns[name] for p in parts]) for name in parts[0].columns
    }


def test_channels_are_aligned_to_the_instants_of_the_force(aligner):
    feed(aligner, 1000)
    time_ns, columns = collect(aligner)
    assert np.all(np.diff(time_ns) == MS)
    assert np.array_equal(columns["force"], truth("force", time_ns))
    assert columns["displacement"] == pytest.approx(truth("displacement", time_ns), abs=1e-9)
    assert columns["actuator_position"][8:] == pytest.approx(truth("displacement", time_ns[8:]), abs=1e-6)
    assert columns["coil_drive"] == pytest.approx(truth("coil_voltage", time_ns), abs=1e-9)
    assert columns["temperature"][1:] == pytest.approx(truth("temperature", time_ns[1:]))
    inner = slice(20, -1)
    assert columns["velocity"][inner] == pytest.approx(truth("velocity", time_ns[inner]), abs=2e-3)
    assert aligner.lost == {}


def test_small_parts_give_the_same_samples_as_one(aligner):
    single = Aligner(dict.fromkeys(OFFSETS, FakeClockMap(BEGIN)), "coil_voltage")
    parts = []
    for end in range(20, 1001, 20):
        feed(aligner, end, start=end - 20)
        feed(single, end, start=end - 20)
        parts.append(aligner.align())
    time_ns, columns = collect(single)
    parts = [part for part in parts if part is not None]
    assert np.array_equal(np.concatenate([part.time_ns for part in parts]), time_ns)
    for name in columns:
        joined = np.concatenate([part.columns[name] for part in parts])
        if name == "velocity":
            assert joined[20:] == pytest.approx(columns[name][20:], abs=1e-12)
        elif name != "actuator_position":
            assert joined == pytest.approx(columns[name], abs=1e-9)


def test_samples_wait_for_a_slow_channel_up_to_a_limit(aligner):
    feed(aligner, 400)
    collect(aligner)
    feed(aligner, 1200, skip=("coil_voltage",), start=400)
    assert collect(aligner)[0][-1] == BEGIN + 399 * MS + OFFSETS["coil_amplifier"] // MS * MS
    assert aligner.lost == {}
    feed(aligner, 1800, skip=("coil_voltage",), start=1200)
    assert aligner.align() is None  # its samples lack the drive and are lost
    assert aligner.lost["coil_voltage"] > 1300


def test_optional_channel_that_lags_is_missing(aligner):
    feed(aligner, 400)
    collect(aligner)
    feed(aligner, 1900, skip=("actuator_position",), start=400)
    time_ns, columns = collect(aligner)
    assert np.isnan(columns["actuator_position"][-500:]).all()
    assert aligner.lost["actuator_position"] >= np.isnan(columns["actuator_position"]).sum() > 0
    assert set(aligner.lost) == {"actuator_position"}
    assert np.all(np.diff(time_ns) == MS)


def test_gap_in_the_force_is_counted_and_not_filled(aligner):
    feed(aligner, 200)
    collect(aligner)
    feed(aligner, 240, skip=("force",), start=200)
    feed(aligner, 600, start=240)
    time_ns, _ = collect(aligner)
    assert aligner.lost["force"] == 40
    assert 41 * MS in np.diff(time_ns)


def test_bad_samples_are_counted_as_lost_and_not_used(aligner):
    feed(aligner, 200)
    first = collect(aligner)[0]
    feed(aligner, 300, skip=("force",), start=200)
    aligner.feed(block("force", 200, 50, "bad"))
    aligner.feed(block("force", 250, 50))
    time_ns, _ = collect(aligner)
    assert aligner.lost["force"] == 50
    assert time_ns[0] - first[-1] <= 20 * MS
    assert not np.any((time_ns >= BEGIN + 200 * MS) & (time_ns < BEGIN + 250 * MS))


def test_samples_in_a_gap_of_the_displacement_are_lost(aligner):
    feed(aligner, 400, skip=("displacement",))
    for begin in (0, 100, 150, 250, 300):
        aligner.feed(block("displacement", begin, 50))
    time_ns, columns = collect(aligner)
    gap = (time_ns > BEGIN + 201 * MS) & (time_ns < BEGIN + 249 * MS)
    assert not gap.any()
    assert aligner.lost["displacement"] >= 50 + 50
    assert np.isfinite(columns["velocity"]).all()


def test_samples_without_a_clock_take_the_time_of_receipt(aligner):
    ascii_force = Aligner({**dict.fromkeys(OFFSETS, FakeClockMap(BEGIN))}, "coil_voltage")
    feed(ascii_force, 1000, skip=("force",))
    for k in range(20):
        values = np.array([float(k)])
        one = SampleBlock("force", k, None, BEGIN + (k * 50 + 5) * MS, values, values, "uncertain")
        ascii_force.feed(Batch("ascii", (one,)))
    time_ns, columns = collect(ascii_force)
    assert np.all(np.diff(time_ns) == 50 * MS)
    assert columns["force"][0] == 0.0


def test_memory_is_bounded(aligner):
    for begin in range(0, 60_000, 2000):
        aligner.feed(block("displacement", begin, 2000))
        aligner.align()
    assert aligner._buffers["displacement"].size <= 20_000
