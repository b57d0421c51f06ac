"""Logs that the bench writes and the identification reads; both share the file and no code."""

import numpy as np
import pytest

from bench.log.header import ChannelInfo, RunHeader
from bench.log.reader import read_log
from bench.log.writer import LogWriter
from identification.errors import UnreadableLogError
from identification.logs.recording import load

RATE = 1000
COUNT = 600
START = 3_000_000_000
"""Bench clock of the first sample [ns]."""


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "cache"))


def header(**more):
    lowpass = {"kind": "butterworth", "order": 2, "cutoff_hz": 200.0}
    fields = {
        "id": "r1",
        "specimen": "S-1",
        "method": "two_sines",
        "drive_kind": "coil_v",
        "drive_unit": "V",
        "source": "run",
        "channels": {"force": ChannelInfo(unit="N", rate_hz=1000.0, filter=lowpass, delay_s=1.1e-3)},
    }
    return RunHeader(**(fields | more))


@pytest.fixture
def log(tmp_path):
    """Return the path of a log with two segments in one continuous recording, and the written samples."""
    path = tmp_path / "run.mcap"
    rng = np.random.default_rng(0)
    time = START + np.arange(COUNT) * (10**9 // RATE)
    fields = ("displacement", "velocity", "force", "coil_drive", "temperature")
    written = {name: rng.standard_normal(COUNT) for name in fields}
    with LogWriter(path, header()) as writer:
        for index, (start, stop) in enumerate([(100, 300), (350, 500)]):
            mark = {"index": index, "name": f"s{index}", "stretch": "two_sines", "motion": "sine"}
            mark |= {"drive": "constant", "amplitude": 0.01, "frequency": 2.0, "drive_value": 0.1 * index}
            writer.write_segment(int(time[start]), phase="start", **mark)
            writer.write_segment(int(time[stop - 1]), phase="end", **mark)
        writer.write_samples(time, written)
    return path, written


def test_samples_are_read_as_they_were_written(log):
    path, written = log
    (stretch,) = load(path).stretches
    assert np.array_equal(stretch.displacement, written["displacement"])
    assert np.array_equal(stretch.force, written["force"])
    assert np.array_equal(stretch.drive, written["coil_drive"])
    assert stretch.rate == pytest.approx(RATE)
    assert np.all(stretch.measured)


def test_segments_contain_the_same_samples_after_reading(log):
    (stretch,) = load(log[0]).stretches
    assert stretch.name == "two_sines"
    assert [(s.name, s.start, s.stop) for s in stretch.segments] == [("s0", 100, 300), ("s1", 350, 500)]
    assert [s.drive_value for s in stretch.segments] == [0.0, 0.1]
    assert {(s.amplitude, s.frequency) for s in stretch.segments} == {(0.01, 2.0)}


def test_filter_delay_and_drive_are_read(log):
    recording = load(log[0])
    (stretch,) = recording.stretches
    assert (recording.drive_kind, recording.drive_unit) == ("coil_v", "V")
    assert recording.metadata["run"]["source"] == "run"
    assert (stretch.force_filter.kind, stretch.force_filter.cutoff) == ("butterworth", 200.0)
    assert stretch.force_delay == 1.1e-3
    assert stretch.velocity is None


def test_a_measured_velocity_is_read(tmp_path):
    ramp = np.linspace(0.0, 1.0, COUNT)
    values = dict.fromkeys(("displacement", "velocity", "force", "coil_drive"), ramp)
    with LogWriter(tmp_path / "a.mcap", header(velocity_from="measured")) as writer:
        writer.write_samples(np.arange(COUNT) * (10**9 // RATE), values)
    assert np.array_equal(load(tmp_path / "a.mcap").stretches[0].velocity, ramp)


def test_both_readers_return_the_same_samples_and_segments(log):
    path, _ = log
    log_content, (stretch,) = read_log(path), load(path).stretches
    assert np.array_equal(log_content.samples["force"], stretch.force)
    assert np.allclose(log_content.samples["time"], stretch.time, atol=1e-9)
    assert [(s.start, s.stop) for s in log_content.segments] == [(s.start, s.stop) for s in stretch.segments]


def test_a_truncated_log_is_refused_until_salvaged(log):
    path, _ = log
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(UnreadableLogError, match="mrbench salvage"):
        load(path)
