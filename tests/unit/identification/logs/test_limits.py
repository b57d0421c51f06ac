"""Gaps, pauses and ends of segments in a log, at each limit and just beside it."""

import json

import numpy as np
import pytest

from identification.errors import UnreadableLogError
from identification.logs.channel_info import read_channel_info
from identification.logs.log_cache import RawLog
from identification.logs.recording import _make_segments, _make_time_base, _resample, _skip_pause, load
from tests.support.mcap_logs import UNITS, times, writing


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "cache"))


def lengths(path):
    return [len(s.time) for s in load(path).stretches]


@pytest.mark.parametrize(("lost", "found"), [(5, [205]), (6, [100, 100])])
def test_up_to_five_lost_samples_are_filled(tmp_path, lost, found):
    with writing(tmp_path / "a.mcap") as log:
        log.samples(times(100))
        log.samples(times(100, 0.1 + lost / 1000.0))
    assert lengths(tmp_path / "a.mcap") == found


def test_a_stretch_has_at_least_fifty_samples(tmp_path):
    with writing(tmp_path / "a.mcap") as log:
        log.samples(times(50))
        log.samples(times(49, 1.0))
        log.samples(times(100, 2.0))
    assert lengths(tmp_path / "a.mcap") == [50, 100]
    with writing(tmp_path / "b.mcap") as log:
        log.samples(times(49))
    with pytest.raises(UnreadableLogError, match="no 50 consecutive samples"):
        load(tmp_path / "b.mcap")


@pytest.mark.parametrize(("pause", "first"), [(0.49, 60), (0.51, 20)])
def test_an_imported_recording_starts_after_a_pause_of_half_a_second(pause, first):
    time = np.concatenate([np.arange(20) * 0.01, 0.19 + pause + np.arange(100) * 0.01])
    assert _skip_pause(time, 60) == first
    assert _skip_pause(time, 0) == 0
    assert _skip_pause(time, 19) == 19


def test_only_the_last_pause_before_a_segment_counts():
    time = np.concatenate([np.arange(20) * 0.01, 5.0 + np.arange(20) * 0.01, 9.0 + np.arange(20) * 0.01])
    assert (_skip_pause(time, 50), _skip_pause(time, 40), _skip_pause(time, 30)) == (40, 40, 20)


def test_a_time_base_is_uniform_with_the_mean_step():
    time = np.concatenate([np.arange(10), np.arange(13, 20)]) * 0.25
    uniform, nearest = _make_time_base(time)
    np.testing.assert_allclose(uniform, np.arange(20) * 0.25)
    np.testing.assert_array_equal(nearest, [*range(10), *range(13, 20)])
    # Time stamps of 0.5 ms at a step of 1.3 ms: their median is 1.5 ms.
    coarse = np.round(np.arange(401) * 2.6) * 5e-4
    assert len(_make_time_base(coarse)[0]) == 401


@pytest.mark.parametrize(("jitter", "kept"), [(0.009, True), (0.011, False)])
def test_values_are_interpolated_from_a_jitter_of_a_hundredth_of_a_step(jitter, kept):
    uniform = np.arange(20) * 0.5
    time = uniform.copy()
    time[7] += jitter * 0.5
    values = time**3
    found = _resample(uniform, time, values, 3)
    assert (found is values) == kept
    if not kept:
        np.testing.assert_allclose(found, uniform**3, atol=1e-9)
    holes = np.where(np.arange(20) == 4, np.nan, values)
    if not kept:
        np.testing.assert_allclose(_resample(uniform, time, holes, 3), uniform**3, atol=1e-9)


def mark(phase, time, index=0, stretch="s"):
    return {
        "phase": phase,
        "time": time,
        "index": index,
        "stretch": stretch,
        "name": f"n{index}",
        "motion": "sine",
    }


@pytest.mark.parametrize(
    ("marks", "parts"),
    [
        ([mark("start", 0.2), mark("end", 0.5)], [(2, 6)]),
        ([mark("start", 0.24), mark("end", 0.54)], [(2, 6)]),
        ([mark("start", 0.26), mark("end", 0.56)], [(3, 7)]),
        ([mark("start", 0.3)], [(3, 10)]),
        ([mark("start", 0.3), mark("end", 0.4)], [(3, 5)]),
        ([mark("start", 0.3), mark("end", 0.3)], []),
        ([mark("start", 0.3, stretch="t"), mark("end", 0.9)], []),
        ([mark("start", 0.0), mark("end", 0.3), mark("start", 0.4, 1), mark("end", 0.9, 1)], [(0, 4), (4, 10)]),
    ],
)
def test_a_segment_has_at_least_two_samples_up_to_the_nearest_at_its_ends(marks, parts):
    found = _make_segments(RawLog({}, marks, {}), "s", np.arange(10) * 0.1)
    assert [(s.start, s.stop) for s in found] == parts
    assert [s.index for s in found] == list(range(len(parts)))


def test_time_counts_in_seconds_from_the_first_sample_also_for_segments(tmp_path):
    start = 1.7e9
    with writing(tmp_path / "a.mcap") as log:
        log.segment("start", start + 0.05)
        log.samples(times(200, 0.0, 1000.0) + start)
        log.segment("end", start + 0.1)
    (found,) = load(tmp_path / "a.mcap").stretches
    assert found.time[[0, -1]] == pytest.approx([0.0, 0.199])
    assert found.rate == pytest.approx(1000.0)
    assert (found.segments[0].start, found.segments[0].stop) == (50, 101)


@pytest.mark.parametrize(
    ("units", "fields", "measured"),
    [
        ({"velocity_from": "measured"}, ("velocity",), True),
        ({"velocity_from": "derived"}, ("velocity",), False),
        ({}, ("velocity",), False),
        ({"velocity_from": "measured"}, (), False),
    ],
)
def test_only_a_measured_velocity_counts(tmp_path, units, fields, measured):
    raw = RawLog(dict.fromkeys(fields, np.zeros(3)), [], {"units": units})
    info = read_channel_info(tmp_path, raw)
    assert info.velocity_measured == measured
    assert not info.interpolated
    assert info.delays == {"displacement": 0.0, "force": 0.0, "coil_drive": 0.0}


@pytest.mark.parametrize(
    ("described", "order", "delay"),
    [({}, None, 0.0), ({"delay_s": 0.002}, None, 0.002), ({"delay_s": None}, None, 0.0),
     ({"filter": {"kind": "b", "order": 3, "cutoff_hz": 90}}, 3, 0.0)],
)  # fmt: skip
def test_a_filter_and_a_delay_are_read_separately(tmp_path, described, order, delay):
    raw = RawLog({}, [], {"units": {}, "channels": {"force": json.dumps(described)}})
    info = read_channel_info(tmp_path, raw)
    assert info.delays["force"] == delay
    assert (info.filters["force"] and info.filters["force"].order) == order


def test_a_new_name_starts_a_new_recording_and_the_same_name_does_not(tmp_path):
    with writing(tmp_path / "a.mcap", UNITS) as log:
        for index, name in enumerate(("one", "one", "two")):
            log.segment("start", 0.1 * index, index, name)
            log.samples(times(100, 0.1 * index))
    found = load(tmp_path / "a.mcap").stretches
    assert [(s.name, len(s.time), len(s.segments)) for s in found] == [("one", 200, 2), ("two", 100, 1)]


@pytest.mark.parametrize(("stated", "kind"), [("driver_command_v", "driver_command_v"), ("", "coil_a")])
def test_the_kind_of_drive_follows_its_unit_unless_the_run_states_it(tmp_path, stated, kind):
    from mcap.writer import Writer

    from tests.support.mcap_logs import Log

    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start("mrbench")
        writer.add_metadata("units", UNITS | {"coil_drive": "A"})
        if stated:
            writer.add_metadata("run", {"drive_kind": stated})
        Log(writer).samples(times(60))
        writer.finish()
    found = load(tmp_path / "a.mcap")
    assert (found.drive_kind, found.drive_unit) == (kind, "A")
    assert found.stretches[0].name == "recording"
