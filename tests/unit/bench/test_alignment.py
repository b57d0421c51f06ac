import numpy as np
import pytest

from bench.rig.acquisition import Batch
from bench.rig.alignment import Aligner
from drivers.channel import Block

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


class Shifted:
    """A clock that stands still beside the bench's."""

    known = True

    def bench_ns(self, device_ns):
        return np.asarray(device_ns) + BEGIN


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
    return Batch(instrument, (Block(channel, first, device, 0, values, values, quality),))


@pytest.fixture
def aligner():
    return Aligner(dict.fromkeys(OFFSETS, Shifted()), "coil_voltage")


def fed(aligner, milliseconds, skip=(), start=0):
    for begin in range(start, milliseconds, 20):
        for channel, (_, period) in CHANNELS.items():
            if channel not in skip and begin % period in range(0, 20) and (20 // period or begin % period == 0):
                aligner.feed(block(channel, begin // period, max(20 // period, 1)))


def collected(aligner):
    parts = list(iter(aligner.ready, None))
    return np.concatenate([p.time_ns for p in parts]), {
        name: np.concatenate([p.columns[name] for p in parts]) for name in parts[0].columns
    }


def test_channels_come_to_the_instants_of_the_force(aligner):
    fed(aligner, 1000)
    time_ns, columns = collected(aligner)
    assert np.all(np.diff(time_ns) == MS)
    assert np.array_equal(columns["force"], truth("force", time_ns))
    assert columns["displacement"] == pytest.approx(truth("displacement", time_ns), abs=1e-9)
    assert columns["actuator_position"][8:] == pytest.approx(truth("displacement", time_ns[8:]), abs=1e-6)
    assert columns["coil_drive"] == pytest.approx(truth("coil_voltage", time_ns), abs=1e-9)
    assert columns["temperature"][1:] == pytest.approx(truth("temperature", time_ns[1:]))
    inner = slice(20, -1)
    assert columns["velocity"][inner] == pytest.approx(truth("velocity", time_ns[inner]), abs=2e-3)
    assert aligner.lost == {}


def test_pieces_give_the_same_as_the_whole(aligner):
    whole = Aligner(dict.fromkeys(OFFSETS, Shifted()), "coil_voltage")
    parts = []
    for end in range(20, 1001, 20):
        fed(aligner, end, start=end - 20)
        fed(whole, end, start=end - 20)
        parts.append(aligner.ready())
    time_ns, columns = collected(whole)
    parts = [part for part in parts if part is not None]
    assert np.array_equal(np.concatenate([part.time_ns for part in parts]), time_ns)
    for name in columns:
        pieces = np.concatenate([part.columns[name] for part in parts])
        if name == "velocity":
            assert pieces[20:] == pytest.approx(columns[name][20:], abs=1e-12)
        elif name != "actuator_position":
            assert pieces == pytest.approx(columns[name], abs=1e-9)


def test_samples_wait_for_a_slow_channel_but_not_for_ever(aligner):
    fed(aligner, 400)
    collected(aligner)
    fed(aligner, 1200, skip=("coil_voltage",), start=400)
    assert collected(aligner)[0][-1] == BEGIN + 399 * MS + OFFSETS["coil_amplifier"] // MS * MS
    assert aligner.lost == {}
    fed(aligner, 1800, skip=("coil_voltage",), start=1200)
    assert aligner.ready() is None  # its samples lack the drive and are lost
    assert aligner.lost["coil_voltage"] > 1300


def test_an_optional_channel_that_falls_behind_leaves_its_field_out(aligner):
    fed(aligner, 400)
    collected(aligner)
    fed(aligner, 1900, skip=("actuator_position",), start=400)
    time_ns, columns = collected(aligner)
    assert np.isnan(columns["actuator_position"][-500:]).all()
    assert aligner.lost["actuator_position"] >= np.isnan(columns["actuator_position"]).sum() > 0
    assert set(aligner.lost) == {"actuator_position"}
    assert np.all(np.diff(time_ns) == MS)


def test_a_gap_in_the_force_is_counted_and_left_open(aligner):
    fed(aligner, 200)
    collected(aligner)
    fed(aligner, 240, skip=("force",), start=200)
    fed(aligner, 600, start=240)
    time_ns, _ = collected(aligner)
    assert aligner.lost["force"] == 40
    assert 41 * MS in np.diff(time_ns)


def test_bad_samples_are_lost_and_never_used(aligner):
    fed(aligner, 200)
    first = collected(aligner)[0]
    fed(aligner, 300, skip=("force",), start=200)
    aligner.feed(block("force", 200, 50, "bad"))
    aligner.feed(block("force", 250, 50))
    time_ns, _ = collected(aligner)
    assert aligner.lost["force"] == 50
    assert time_ns[0] - first[-1] <= 20 * MS
    assert not np.any((time_ns >= BEGIN + 200 * MS) & (time_ns < BEGIN + 250 * MS))


def test_a_hole_in_the_displacement_loses_its_samples(aligner):
    fed(aligner, 400, skip=("displacement",))
    for begin in (0, 100, 150, 250, 300):
        aligner.feed(block("displacement", begin, 50))
    time_ns, columns = collected(aligner)
    hole = (time_ns > BEGIN + 201 * MS) & (time_ns < BEGIN + 249 * MS)
    assert not hole.any()
    assert aligner.lost["displacement"] >= 50 + 50
    assert np.isfinite(columns["velocity"]).all()


def test_an_instrument_without_a_clock_is_stamped_by_receipt(aligner):
    ascii_force = Aligner({**dict.fromkeys(OFFSETS, Shifted())}, "coil_voltage")
    fed(ascii_force, 1000, skip=("force",))
    for k in range(20):
        values = np.array([float(k)])
        one = Block("force", k, None, BEGIN + (k * 50 + 5) * MS, values, values, "uncertain")
        ascii_force.feed(Batch("ascii", (one,)))
    time_ns, columns = collected(ascii_force)
    assert np.all(np.diff(time_ns) == 50 * MS)
    assert columns["force"][0] == 0.0


def test_memory_is_bounded(aligner):
    for begin in range(0, 60_000, 2000):
        aligner.feed(block("displacement", begin, 2000))
        aligner.ready()
    assert aligner._tracks["displacement"].size <= 20_000
