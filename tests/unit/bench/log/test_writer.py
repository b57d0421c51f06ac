import errno
import json
import os

import numpy as np
import orjson
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from bench.errors import LogError
from bench.log.columns import make_sample_messages
from bench.log.reader import read_log
from bench.log.writer import LogWriter
from tests.support.logs import MILLISECOND, header, times, values, write_log

ONE = {"displacement": 0.001, "velocity": 0.02, "force": 12.5, "coil_drive": 0.2}


class WallClock:
    """A clock that a test sets."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def chunks(path):
    with path.open("rb") as file:
        return [record for record in StreamReader(file, emit_chunks=True).records if isinstance(record, Chunk)]


def outcome(path):
    return read_log(path).metadata["outcome"]


def test_log_and_publish_time_are_the_timestamp_of_the_message(tmp_path):
    write_log(tmp_path / "run.mcap")

    with (tmp_path / "run.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/bench/sample"]):
            clock = json.loads(message.data)["timestamp"]
            assert message.log_time == message.publish_time == clock["sec"] * 10**9 + clock["nsec"]


def test_profile_is_mrbench(tmp_path):
    write_log(tmp_path / "run.mcap")

    with (tmp_path / "run.mcap").open("rb") as file:
        assert make_reader(file).get_header().profile == "mrbench"


def test_samples_written_at_once_and_one_by_one_are_the_same(tmp_path):
    columns = values(50, temperature=np.full(50, 21.5), segment=np.where(np.arange(50) < 20, -1, 4))

    with LogWriter(tmp_path / "many.mcap", header()) as log:
        log.write_samples(times(50), columns)
    with LogWriter(tmp_path / "single.mcap", header()) as log:
        for i, moment in enumerate(times(50).tolist()):
            log.write_sample(moment, {name: column[i] for name, column in columns.items()})

    many, single = read_log(tmp_path / "many.mcap").samples, read_log(tmp_path / "single.mcap").samples
    assert list(many) == list(single)
    for name, column in many.items():
        np.testing.assert_array_equal(column, single[name])


def test_many_samples_have_the_same_bytes_as_single_dictionaries():
    columns = values(3, temperature=[np.nan, 20.0, 21.0])

    messages = [message for _, message in make_sample_messages(times(3), columns)]

    assert orjson.dumps(orjson.loads(messages[1])) == messages[1]
    assert "temperature" not in json.loads(messages[0])
    assert json.loads(messages[2])["temperature"] == 21.0


def test_chunks_are_closed_by_bench_time(tmp_path):
    write_log(tmp_path / "run.mcap")

    spans = [chunk.message_end_time - chunk.message_start_time for chunk in chunks(tmp_path / "run.mcap")]

    assert len(spans) >= 3.0 / 0.2
    assert max(spans) <= 200 * MILLISECOND


def test_chunks_are_closed_by_wall_time_when_the_bench_clock_is_slow(tmp_path):
    clock = WallClock()
    with LogWriter(tmp_path / "run.mcap", header(), clock) as log:
        for i in range(10):
            log.write_sample(i, ONE)
            clock.now += 0.15

    assert len(chunks(tmp_path / "run.mcap")) == 5


def test_log_is_synced_four_times_a_second_of_wall_time(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(os, "fsync", synced.append)
    clock = WallClock()
    with LogWriter(tmp_path / "run.mcap", header(), clock) as log:
        at_open = len(synced)
        for i in range(1001):
            clock.now = i * 0.002
            log.write_sample(i * 2 * MILLISECOND, ONE)
        while_writing = len(synced) - at_open

    assert 4 <= while_writing <= 8


def test_a_log_written_faster_than_real_time_is_synced_only_at_open_and_close(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(os, "fsync", synced.append)

    with LogWriter(tmp_path / "run.mcap", header(), WallClock()) as log:
        log.write_samples(times(5000), values(5000))

    assert len(synced) == 2


def test_completed_log_is_clean_and_counts_its_messages(tmp_path):
    write_log(tmp_path / "run.mcap")

    final = outcome(tmp_path / "run.mcap")

    assert final["outcome"] == "clean"
    assert (final["/bench/sample"], final["/bench/segment"], final["/bench/event"]) == ("1500", "2", "1")


def test_log_with_lost_samples_is_lossy_and_names_the_channel(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_sample(0, ONE)
        log.count_lost("force", 3)

    assert outcome(tmp_path / "run.mcap")["outcome"] == "lossy"
    assert json.loads(outcome(tmp_path / "run.mcap")["lost"]) == {"force": 3}


def test_log_after_an_exception_is_incomplete_with_its_reason(tmp_path):
    def write_and_fail(log):
        log.write_sample(0, ONE)
        raise RuntimeError("the wire went quiet")

    with pytest.raises(RuntimeError), LogWriter(tmp_path / "run.mcap", header()) as log:
        write_and_fail(log)

    assert outcome(tmp_path / "run.mcap")["outcome"] == "incomplete"
    assert outcome(tmp_path / "run.mcap")["reason"] == "RuntimeError: the wire went quiet"


def test_closed_log_cannot_be_closed_again(tmp_path):
    log = LogWriter(tmp_path / "run.mcap", header())
    log.close("incomplete")

    with pytest.raises(LogError, match="closed"):
        log.close()


def test_header_is_written_before_the_first_sample(tmp_path):
    write_log(tmp_path / "run.mcap")

    with (tmp_path / "run.mcap").open("rb") as file:
        names = [getattr(record, "name", "sample") for record in StreamReader(file, emit_chunks=True).records]

    assert names[1:7] == ["run", "units", "calibration", "clocks", "channels", "README.txt"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"force": None}, "force is missing"),
        ({"load": 3.0}, "there is no field load"),
        ({"force": float("nan")}, "force is nan at 0.000000 s"),
    ],
)
def test_invalid_sample_is_refused(tmp_path, change, message):
    bad = {name: value for name, value in {**ONE, **change}.items() if value is not None}

    with LogWriter(tmp_path / "run.mcap", header()) as log, pytest.raises(LogError, match=message):
        log.write_sample(0, bad)


@pytest.mark.parametrize(
    ("time_ns", "column", "message"),
    [
        (times(3), [1.0, np.inf, 2.0], "force is inf at 0.002000 s"),
        (times(3), [1.0, 2.0], "one value per sample"),
        (times(3)[::-1], [1.0, 2.0, 3.0], "increases"),
    ],
)
def test_invalid_samples_are_refused_before_any_is_written(tmp_path, time_ns, column, message):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_sample(0, ONE)
        with pytest.raises(LogError, match=message):
            log.write_samples(time_ns, values(3, force=column))

    assert len(read_log(tmp_path / "run.mcap").samples["time"]) == 1


def test_time_that_does_not_increase_is_refused(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_sample(5, ONE)
        with pytest.raises(LogError, match="bench clock"):
            log.write_sample(5, ONE)


def test_log_that_cannot_be_opened_is_named(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        LogWriter(tmp_path / "nowhere" / "run.mcap", header())


def test_full_disk_is_an_error_that_names_the_log(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    log = LogWriter(tmp_path / "run.mcap", header())
    monkeypatch.setattr(os, "fsync", full)

    with pytest.raises(LogError, match=r"run\.mcap: no space left on device"):
        log.close()


def test_samples_one_nanosecond_apart_are_accepted_and_the_first_that_goes_back_is_named():
    assert len(list(make_sample_messages(np.array([0, 1, 2]), values(3)))) == 3
    with pytest.raises(LogError, match=r"sample at 4\.000000 s after one at 5\.000000 s"):
        list(make_sample_messages(np.array([0, 1, 5_000_000_000, 4_000_000_000]), values(4)))


@pytest.mark.parametrize(("segment", "fields"), [(-1, set()), (0, {"segment"}), (1, {"segment"})])
def test_segment_zero_is_a_segment_and_a_negative_one_is_none(tmp_path, segment, fields):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.write_sample(0, {**ONE, "segment": segment, "temperature": float("nan")})

    assert read_log(tmp_path / "run.mcap").samples.keys() - {"time", "time_ns", *ONE} == fields


def test_attachment_has_the_time_of_the_last_sample_and_zero_before_the_first(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        log.attach("before", "text/plain", b"")
        log.write_sample(7, ONE)
        log.attach("after", "text/plain", b"")

    with (tmp_path / "run.mcap").open("rb") as file:
        times_by_name = {one.name: one.log_time for one in make_reader(file).iter_attachments()}
    assert (times_by_name["before"], times_by_name["after"]) == (0, 7)


def test_segment_mark_has_the_shunt_only_if_it_is_on(tmp_path):
    mark = {"stretch": "t", "motion": "hold", "drive": "constant"}
    with LogWriter(tmp_path / "run.mcap", header()) as log:
        for index, shunt in enumerate((False, True)):
            log.write_segment(index, phase="start", index=index, name=f"s{index}", shunt=shunt, **mark)
            log.write_sample(index, ONE)

    with (tmp_path / "run.mcap").open("rb") as file:
        marks = [json.loads(message.data) for _, _, message in make_reader(file).iter_messages("/bench/segment")]
    assert [one.get("shunt") for one in marks] == [None, True]
    assert [one.shunt for one in read_log(tmp_path / "run.mcap").segments] == [False, True]
