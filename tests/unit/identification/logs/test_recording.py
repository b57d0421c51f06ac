import json

import numpy as np
import pytest
from mcap.writer import CompressionType

from identification.errors import UnreadableLogError
from identification.logs import log_cache
from identification.logs.recording import load
from tests.support.mcap_logs import UNITS, times, writing


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "logs"


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "run.mcap"
    with writing(path) as written:
        written.segment("start", 5.1)
        written.samples(times(300, 5.0))
        written.segment("end", 5.2)
    return path


def test_channels_come_as_arrays_on_a_uniform_time_base(log):
    (stretch,) = load(log).stretches
    assert stretch.rate == pytest.approx(1000.0)
    assert np.allclose(stretch.time, times(300))
    assert np.allclose(stretch.displacement, np.arange(300) * 1e-5)
    assert np.allclose(stretch.force, np.arange(300))
    assert np.all(stretch.drive == 0.5)
    assert np.all(stretch.measured)


def test_a_recording_knows_its_drive_and_metadata(log):
    recording = load(log)
    assert (recording.drive_kind, recording.drive_unit) == ("coil_v", "V")
    assert recording.metadata["run"]["method"] == "quick"
    assert len(recording.sha256) == 64


def test_segments_contain_the_samples_between_their_messages(log):
    (segment,) = load(log).stretches[0].segments
    assert (segment.start, segment.stop) == (100, 201)
    assert (segment.motion, segment.amplitude, segment.frequency) == ("sine", 0.01, 2.0)
    assert segment.drive_value is None


def test_a_segment_without_end_reaches_to_the_end(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.segment("start", 0.05)
        written.samples(times(100))
    (segment,) = load(tmp_path / "a.mcap").stretches[0].segments
    assert (segment.start, segment.stop) == (50, 100)


def test_the_force_is_not_valid_near_a_segment_with_the_shunt(tmp_path):
    """The shunt is switched within half a second of its segment."""
    with writing(tmp_path / "a.mcap") as written:
        written.segment("start", 1.0, 0, shunt=True, motion="hold")
        written.samples(times(3000))
        written.segment("end", 1.5, 0, shunt=True, motion="hold")
    (stretch,) = load(tmp_path / "a.mcap").stretches
    assert np.flatnonzero(~stretch.valid_mask).tolist() == list(range(500, 2001))
    assert np.all(stretch.measured)
    assert load(tmp_path / "a.mcap").stretches[0].force_valid.sum() == 3000 - 1501  # from the cache


def test_imported_files_keep_their_names_and_rates(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.segment("start", 0.02, 0, "slow")
        written.samples(times(100, 0.0, 200.0))
        written.segment("end", 0.4, 0, "slow")
        written.segment("start", 1.6, 1, "fast")
        written.samples(times(200, 1.5, 1000.0))
        written.segment("end", 1.65, 1, "fast")
    slow, fast = load(tmp_path / "a.mcap").stretches
    assert (slow.name, len(slow.time), round(slow.rate)) == ("slow", 100, 200)
    assert (fast.name, len(fast.time), round(fast.rate)) == ("fast", 200, 1000)
    assert fast.time[0] == pytest.approx(1.5)
    assert [s.name for s in slow.segments + fast.segments] == ["segment 0", "segment 1"]


def test_a_recording_without_segments_takes_the_name_of_its_method(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.samples(times(100))
    assert load(tmp_path / "a.mcap").stretches[0].name == "quick"


def test_a_few_lost_samples_are_filled_and_marked(tmp_path):
    kept = np.delete(np.arange(200), [80, 81, 82])
    with writing(tmp_path / "a.mcap") as written:
        written.samples(kept / 1000.0, force=[float(k) for k in kept])
    (stretch,) = load(tmp_path / "a.mcap").stretches
    assert np.flatnonzero(~stretch.measured).tolist() == [80, 81, 82]
    assert np.allclose(stretch.force, np.arange(200.0))


def test_a_longer_gap_cuts_the_recording(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.samples(times(100))
        written.samples(times(120, 0.110))
    assert [len(s.time) for s in load(tmp_path / "a.mcap").stretches] == [100, 120]


def test_a_missing_value_counts_as_lost(tmp_path):
    force = [float(k) if k != 50 else None for k in range(100)]
    with writing(tmp_path / "a.mcap") as written:
        written.samples(times(100), force=force)
    (stretch,) = load(tmp_path / "a.mcap").stretches
    assert np.flatnonzero(~stretch.measured).tolist() == [50]
    assert stretch.force[50] == pytest.approx(50.0)


def test_jitter_is_resampled_onto_a_uniform_time_base(tmp_path):
    jittered = times(200) + 2e-4 * np.sin(np.arange(200.0))
    with writing(tmp_path / "a.mcap") as written:
        written.samples(jittered, displacement=np.sin(10.0 * jittered).tolist())
    (stretch,) = load(tmp_path / "a.mcap").stretches
    assert np.ptp(np.diff(stretch.time)) < 1e-9
    assert np.allclose(stretch.displacement, np.sin(10.0 * (stretch.time + jittered[0])), atol=1e-7)


def test_velocity_is_given_only_where_it_was_measured(tmp_path, log):
    assert load(log).stretches[0].velocity is None
    with writing(tmp_path / "a.mcap", UNITS | {"velocity_from": "measured"}) as written:
        written.samples(times(100))
    assert np.allclose(load(tmp_path / "a.mcap").stretches[0].velocity, 0.01)


def test_filters_and_delays_are_those_that_the_devices_report(tmp_path):
    lowpass = {"filter": {"kind": "butterworth", "order": 2, "cutoff_hz": 200.0}, "delay_s": 1e-3}
    channels = {"force": json.dumps(lowpass), "displacement": json.dumps({"filter": None, "delay_s": 2e-4})}
    with writing(tmp_path / "a.mcap", channels=channels) as written:
        written.samples(times(100))
    (stretch,) = load(tmp_path / "a.mcap").stretches
    assert (stretch.force_filter.order, stretch.force_filter.cutoff) == (2, 200.0)
    assert stretch.displacement_filter is None
    assert (stretch.force_delay, stretch.displacement_delay, stretch.drive_delay) == (1e-3, 2e-4, 0.0)


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
@pytest.mark.parametrize("chunked", [True, False])
def test_every_compression_is_read(tmp_path, compression, chunked):
    with writing(tmp_path / "a.mcap", compression=compression, use_chunking=chunked) as written:
        written.samples(times(100))
    assert len(load(tmp_path / "a.mcap").stretches[0].time) == 100


def test_the_second_reading_comes_from_the_cache(log, cache, monkeypatch):
    first = load(log)
    monkeypatch.setattr("identification.logs.log_reader.read_log", None)
    second = load(log)
    assert len(list(cache.iterdir())) == 1
    assert np.array_equal(second.stretches[0].force, first.stretches[0].force)
    assert second.stretches[0].segments == first.stretches[0].segments
    assert second.metadata == first.metadata


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not an archive", None])
def test_a_damaged_cache_entry_is_read_again_and_replaced(log, cache, content):
    load(log)
    (entry,) = cache.iterdir()
    whole = entry.read_bytes()
    entry.write_bytes(whole[: len(whole) // 2] if content is None else content)
    assert len(load(log).stretches[0].time) == 300
    assert len(entry.read_bytes()) == len(whole)


def test_a_cache_that_cannot_be_written_is_ignored(log, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "file"))
    assert len(load(log).stretches) == 1


def test_the_least_recently_used_entries_are_removed_from_the_cache(log, cache):
    load(log)
    (entry,) = cache.iterdir()
    raw = log_cache.read_entry(entry.name.split(".")[0])
    log_cache.write_entry("another", raw, max_size=entry.stat().st_size + 10)
    assert [remaining.name.split(".")[0] for remaining in cache.iterdir()] == ["another"]


def write_broken(tmp_path, log, content):
    path = tmp_path / "broken.mcap"
    path.write_bytes(content(log.read_bytes()))
    return path


@pytest.mark.parametrize("share", [0.05, 0.4, 0.7, 0.99])
def test_a_truncated_log_is_refused_with_the_command_that_repairs_it(tmp_path, log, share):
    path = write_broken(tmp_path, log, lambda whole: whole[: int(share * len(whole))])
    with pytest.raises(UnreadableLogError, match=r"truncated or damaged .* run `mrbench salvage .*broken\.mcap`"):
        load(path)


@pytest.mark.parametrize("content", [b"", b"time_s,force_n\n0,1\n"])
def test_a_file_that_is_not_a_log_is_refused(tmp_path, log, content):
    with pytest.raises(UnreadableLogError, match="not an MCAP log"):
        load(write_broken(tmp_path, log, lambda _: content))


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(UnreadableLogError, match="cannot be opened"):
        load(tmp_path / "nowhere.mcap")


def test_a_log_without_samples_is_refused(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.put("/bench/event", 0.0, {"kind": "state"})
    with pytest.raises(UnreadableLogError, match="contains no /bench/sample messages"):
        load(tmp_path / "a.mcap")


def test_a_log_of_a_few_samples_is_refused(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.samples(times(20))
    with pytest.raises(UnreadableLogError, match="no 50 consecutive samples"):
        load(tmp_path / "a.mcap")


def test_a_message_that_is_not_json_is_refused(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        written.writer.add_message(written.topics["/bench/sample"], 0, b"{1", 0)
    with pytest.raises(UnreadableLogError, match="a message is not JSON"):
        load(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("units", "reason"),
    [
        (None, "no metadata record 'units'"),
        ({key: unit for key, unit in UNITS.items() if key != "force"}, "unit of 'force' is not given"),
        (UNITS | {"displacement": "mm"}, "unit of 'displacement' is mm, must be m"),
    ],
)
def test_a_log_without_the_right_units_is_refused(tmp_path, units, reason):
    with writing(tmp_path / "a.mcap", units) as written:
        written.samples(times(100))
    with pytest.raises(UnreadableLogError, match=reason):
        load(tmp_path / "a.mcap")


def test_a_log_without_a_channel_is_refused(tmp_path):
    with writing(tmp_path / "a.mcap") as written:
        for time in times(100):
            written.put("/bench/sample", time, {"displacement": 0.0, "coil_drive": 0.0})
    with pytest.raises(UnreadableLogError, match="no channel 'force'"):
        load(tmp_path / "a.mcap")


@pytest.mark.parametrize("described", ["not JSON", '{"filter": {"kind": "butterworth"}}', "[1]"])
def test_an_invalid_description_of_a_channel_is_refused(tmp_path, described):
    with writing(tmp_path / "a.mcap", channels={"force": described}) as written:
        written.samples(times(100))
    with pytest.raises(UnreadableLogError, match="'channels' describes 'force'"):
        load(tmp_path / "a.mcap")
