"""Live recorder: threads, a full queue, errors of the disk."""

import threading

import numpy as np
import pytest

from bench.errors import LogError
from bench.log.header import RunHeader
from bench.log.reader import read_log
from bench.recorder.live_recorder import LiveRecorder
from bench.replay.raw import read_raw_recordings
from drivers.channel import Frame, SampleBlock
from tests.support.fake_rig import FakeClockMap

HEADER = RunHeader(
    id="live", specimen="damper 7", method="sine", drive_kind="coil_v", drive_unit="V", source="run"
)
SECOND = 1_000_000_000


def samples(first, count):
    time_ns = (first + np.arange(count, dtype=np.int64)) * 1_000_000
    return time_ns, {name: np.full(count, 0.5) for name in ("displacement", "velocity", "force", "coil_drive")}


def block(first, values, quality="good", received=SECOND, channel="force"):
    numbers = np.array(values, dtype=np.float64)
    device = (first + np.arange(len(values), dtype=np.int64)) * 1_000_000
    return SampleBlock(channel, first, device, received, numbers, np.round(np.nan_to_num(numbers) * 800), quality)


def test_content_from_many_threads_is_in_the_log(tmp_path):
    with LiveRecorder(tmp_path / "a.mcap", HEADER, maps={"load_cell": FakeClockMap(5 * SECOND)}) as log:

        def wire(name):
            for k in range(500):
                log.write_frame(name, Frame(SECOND + k, bool(k % 2), bytes([k % 256, 255])))
                log.write_blocks(name, (block(k, [k / 3]), block(k, [-k / 7], channel="force_raw")))

        threads = [threading.Thread(target=wire, args=(name,)) for name in ("load_cell", "lvdt")]
        for thread in threads:
            thread.start()
        for k in range(20):
            log.write_samples(*samples(1 + k * 25, 25))
        for thread in threads:
            thread.join()
        log.write_event(SECOND, "state", "run started")
        log.attach("method.json", "application/json", b"{}")
        log.write_clocks({"load_cell": "5 us"})
    log, raw = read_log(tmp_path / "a.mcap"), read_raw_recordings(tmp_path / "a.mcap")
    assert log.outcome == "clean"
    assert len(log.samples["time"]) == 500
    assert log.metadata["clock_error_bounds"] == {"load_cell": "5 us"}
    assert log.attachments["method.json"] == b"{}"
    assert raw["lvdt"].frames == [Frame(SECOND + k, bool(k % 2), bytes([k % 256, 255])) for k in range(500)]
    force = np.concatenate([b.values for b in raw["load_cell"].blocks if b.channel == "force"])
    assert np.array_equal(force, np.arange(500) / 3)


def test_blocks_are_read_as_they_were_written(tmp_path):
    blocks = [block(0, [1.0, 2.5]), block(2, [np.nan, 3.0], "bad"), block(10, [1e-9], received=2 * SECOND)]
    blocks.append(blocks[0]._replace(channel="temperature", device_ns=None, first=7, quality="uncertain"))
    with LiveRecorder(tmp_path / "a.mcap", HEADER) as log:
        log.write_blocks("any", blocks)
        log.write_samples(*samples(1, 3))
    recorded = read_raw_recordings(tmp_path / "a.mcap")["any"].blocks
    assert len(recorded) == len(blocks)
    for one, other in zip(
        *(sorted(side, key=lambda block: block.first) for side in (recorded, blocks)), strict=True
    ):
        assert one._replace(values=None, raw=None, device_ns=None) == other._replace(
            values=None, raw=None, device_ns=None
        )
        assert np.array_equal(one.values, other.values, equal_nan=True)
        assert np.array_equal(one.raw, other.raw)
        assert (one.device_ns is None) == (other.device_ns is None)
        assert other.device_ns is None or np.array_equal(one.device_ns, other.device_ns)


def test_full_queue_drops_frames_first_then_readings_then_samples(tmp_path, monkeypatch):
    writing, free = threading.Event(), threading.Event()

    def slow(*_):
        writing.set()
        assert free.wait(10)

    with LiveRecorder(tmp_path / "a.mcap", HEADER, capacity=100) as log:
        monkeypatch.setattr(log._log, "write_event", slow)
        log.write_event(0, "state", "the disk hangs")
        assert writing.wait(10)
        for k in range(60):
            log.write_frame("lvdt", Frame(k, False, b"x"))
        assert log.dropped_counts == {"/wire/lvdt": 10}
        for k in range(60):
            log.write_blocks("lvdt", (block(k, [1.0, 2.0]),))
        assert log.dropped_counts["/instrument/lvdt"] == 70
        for k in range(60):
            log.write_samples(*samples(1 + k * 10, 10))
        assert log.dropped_counts["samples"] == 350
        free.set()
        assert log.close("clean") == "lossy"
    log = read_log(tmp_path / "a.mcap")
    assert log.outcome == "lossy"
    assert '"samples":350' in log.metadata["outcome"]["lost"]
    assert len(log.samples["time"]) == 250


def test_error_of_the_disk_is_raised_by_later_calls(tmp_path, monkeypatch):
    log = LiveRecorder(tmp_path / "a.mcap", HEADER)

    def fill_disk(*_):
        raise LogError("a.mcap: no space left on device")

    monkeypatch.setattr(log._log, "write_samples", fill_disk)
    log.write_samples(*samples(1, 10))
    log._thread.join(10)
    with pytest.raises(LogError, match="no space left"):
        log.write_samples(*samples(11, 10))
    with pytest.raises(LogError, match="no space left"):
        log.close()


def test_exception_closes_the_log_as_incomplete(tmp_path):
    with LiveRecorder(tmp_path / "a.mcap", HEADER) as log:
        log.write_samples(*samples(1, 10))
        log.__exit__(KeyError, KeyError("x"), None)
    assert read_log(tmp_path / "a.mcap").outcome == "incomplete"


def test_internal_error_of_the_writing_thread_makes_the_log_incomplete(tmp_path, monkeypatch):
    log = LiveRecorder(tmp_path / "a.mcap", HEADER)

    def fail(*_):
        raise ZeroDivisionError("division by zero")

    log.write_samples(*samples(1, 10))
    monkeypatch.setattr(log._log, "write_event", fail)
    log.write_event(0, "state", "never written")
    log._thread.join(10)
    with pytest.raises(LogError, match="internal error of the recorder"):
        log.write_samples(*samples(11, 10))
    with pytest.raises(LogError, match="internal error of the recorder"):
        log.close()
    log = read_log(tmp_path / "a.mcap")
    assert log.outcome == "incomplete"
    assert "division by zero" in log.metadata["outcome"]["reason"]
