import threading

import numpy as np
import pytest

from bench.errors import LogError
from bench.recorder.header import RunHeader
from bench.recorder.live import LiveRecorder
from bench.recorder.reader import read_log
from bench.replay.raw import read_raw
from drivers.channel import Block, Frame

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
    return Block(channel, first, device, received, numbers, np.round(np.nan_to_num(numbers) * 800), quality)


class Later:
    known = True

    def bench_ns(self, device_ns):
        return np.asarray(device_ns) + 5 * SECOND


def test_what_is_recorded_from_many_threads_is_read_again(tmp_path):
    with LiveRecorder(tmp_path / "a.mcap", HEADER, maps={"load_cell": Later()}) as log:

        def wire(name):
            for k in range(500):
                log.frame(name, Frame(SECOND + k, bool(k % 2), bytes([k % 256, 255])))
                log.blocks(name, (block(k, [k / 3]), block(k, [-k / 7], channel="force_raw")))

        threads = [threading.Thread(target=wire, args=(name,)) for name in ("load_cell", "lvdt")]
        for thread in threads:
            thread.start()
        for k in range(20):
            log.samples(*samples(1 + k * 25, 25))
        for thread in threads:
            thread.join()
        log.event(SECOND, "state", "run started")
        log.attach("method.json", "application/json", b"{}")
        log.clocks({"load_cell": "5 us"})
    whole, raw = read_log(tmp_path / "a.mcap"), read_raw(tmp_path / "a.mcap")
    assert whole.outcome == "clean"
    assert len(whole.samples["time"]) == 500
    assert whole.metadata["clock_skew"] == {"load_cell": "5 us"}
    assert whole.attachments["method.json"] == b"{}"
    assert raw["lvdt"].frames == [Frame(SECOND + k, bool(k % 2), bytes([k % 256, 255])) for k in range(500)]
    force = np.concatenate([b.values for b in raw["load_cell"].blocks if b.channel == "force"])
    assert np.array_equal(force, np.arange(500) / 3)


def test_blocks_come_back_as_they_were(tmp_path):
    given = [block(0, [1.0, 2.5]), block(2, [np.nan, 3.0], "bad"), block(10, [1e-9], received=2 * SECOND)]
    given.append(given[0]._replace(channel="temperature", device_ns=None, first=7, quality="uncertain"))
    with LiveRecorder(tmp_path / "a.mcap", HEADER) as log:
        log.blocks("any", given)
        log.samples(*samples(1, 3))
    found = read_raw(tmp_path / "a.mcap")["any"].blocks
    assert len(found) == len(given)
    for one, other in zip(sorted(found, key=lambda b: b.first), sorted(given, key=lambda b: b.first), strict=True):
        assert (one.channel, one.first, one.quality, one.received_ns) == (
            other.channel, other.first, other.quality, other.received_ns,
        )  # fmt: skip
        assert np.array_equal(one.values, other.values, equal_nan=True)
        assert np.array_equal(one.raw, other.raw)
        assert (one.device_ns is None) == (other.device_ns is None)
        assert other.device_ns is None or np.array_equal(one.device_ns, other.device_ns)


def test_a_full_queue_leaves_out_frames_first_then_readings_then_samples(tmp_path, monkeypatch):
    held, free = threading.Event(), threading.Event()

    def slow(*_):
        held.set()
        assert free.wait(10)

    with LiveRecorder(tmp_path / "a.mcap", HEADER, room=100) as log:
        monkeypatch.setattr(log._log, "event", slow)
        log.event(0, "state", "the disk hangs")
        assert held.wait(10)
        for k in range(60):
            log.frame("lvdt", Frame(k, False, b"x"))
        assert log.dropped == {"/wire/lvdt": 10}
        for k in range(60):
            log.blocks("lvdt", (block(k, [1.0, 2.0]),))
        assert log.dropped["/instrument/lvdt"] == 70
        for k in range(60):
            log.samples(*samples(1 + k * 10, 10))
        assert log.dropped["samples"] == 350
        free.set()
        assert log.close("clean") == "lossy"
    whole = read_log(tmp_path / "a.mcap")
    assert whole.outcome == "lossy"
    assert '"samples":350' in whole.metadata["outcome"]["lost"]
    assert len(whole.samples["time"]) == 250


def test_an_error_of_the_disk_is_told_to_whoever_records(tmp_path, monkeypatch):
    log = LiveRecorder(tmp_path / "a.mcap", HEADER)

    def full(*_):
        raise LogError("a.mcap: no space left on device")

    monkeypatch.setattr(log._log, "samples", full)
    log.samples(*samples(1, 10))
    log._thread.join(10)
    with pytest.raises(LogError, match="no space left"):
        log.samples(*samples(11, 10))
    with pytest.raises(LogError, match="no space left"):
        log.close()


def test_an_exception_closes_the_log_as_incomplete(tmp_path):
    with LiveRecorder(tmp_path / "a.mcap", HEADER) as log:
        log.samples(*samples(1, 10))
        log.__exit__(KeyError, KeyError("x"), None)
    assert read_log(tmp_path / "a.mcap").outcome == "incomplete"


def test_a_defect_on_the_writing_thread_does_not_end_in_a_clean_log(tmp_path, monkeypatch):
    log = LiveRecorder(tmp_path / "a.mcap", HEADER)

    def defect(*_):
        raise ZeroDivisionError("division by zero")

    log.samples(*samples(1, 10))
    monkeypatch.setattr(log._log, "event", defect)
    log.event(0, "state", "this cannot be written")
    log._thread.join(10)
    with pytest.raises(LogError, match="defect of the recorder"):
        log.samples(*samples(11, 10))
    with pytest.raises(LogError, match="defect of the recorder"):
        log.close()
    whole = read_log(tmp_path / "a.mcap")
    assert whole.outcome == "incomplete"
    assert "division by zero" in whole.metadata["outcome"]["reason"]
