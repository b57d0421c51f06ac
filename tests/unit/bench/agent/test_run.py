"""One run whose parts fail: its outcome, and the log that it leaves."""

import errno
import itertools
import os
from datetime import UTC, datetime
from types import SimpleNamespace

import pytest
from mcap.reader import make_reader

from bench.agent.run import Run
from bench.agent.run_request import RunRequest
from bench.agent.timing import AgentTiming
from bench.errors import LogError
from bench.log import Identity, chunked_writer
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from bench.methods import compile_method, load_method
from bench.recorder.bench_header import Attachment, LogMetadata
from bench.safety.interlocks import Trip
from bench.sequencer.command_history import CommandHistory
from tests.support.fake_rig import EventLog, FakeRecordingThread
from tests.support.logs import header, times, values

DECODERS = Attachment("decoders.json", "application/json", b"{}")


class FakeSequencer:
    """Sequencer that plays nothing, or raises an error after samples were recorded."""

    def __init__(self):
        self.stop_reason, self.paused_after, self.play = "", "", lambda: None

    def pause(self):
        self.paused_after = "10mm_1Hz_0.2V"

    def stop(self, reason, hold=False):
        self.stop_reason = self.stop_reason or reason

    def run(self, programme):
        self.play()


def raising(error):
    def fail():
        raise error

    return fail


@pytest.fixture
def run(tmp_path):
    ticks = itertools.count()
    identity = Identity("D1", "", datetime.now(UTC))
    method = load_method("quick")
    request = RunRequest(method, compile_method(method), identity, tmp_path / "a.mcap")
    return Run(
        request, CommandHistory(), FakeSequencer(), FakeRecordingThread(), lambda: next(ticks), EventLog(),
        AgentTiming(final_samples=0.0),
    )  # fmt: skip


class FailingDisk:
    """File layer below the log that writes until an error is set."""

    def __init__(self, monkeypatch):
        self.error = None
        open_writer = chunked_writer._open_writer

        def open_failing(path):
            file, mcap = open_writer(path)
            write = file.write
            mcap._Writer__stream = SimpleNamespace(
                write=lambda data: self._write(write, data), tell=file.tell, flush=file.flush
            )
            return file, mcap

        monkeypatch.setattr(chunked_writer, "_open_writer", open_failing)

    def _write(self, write, data):
        if self.error is not None:
            raise self.error
        return write(data)


def execute(run, clocks=dict, trip=None):
    run.execute(LogMetadata(header(), [], lambda: DECODERS, clocks), lambda: trip, {})
    return run.get_status()


def read_outcome(run):
    with run.request.path.open("rb") as file:
        return next(one.metadata for one in make_reader(file).iter_metadata() if one.name == "outcome")


def write_samples(run, samples=200, first=1):
    time_ns = times(samples, first=first)
    run.log.write_samples(time_ns, values(samples))


def test_run_and_log_have_the_same_outcome(run):
    assert run.get_status().ending is None
    status = execute(run)
    assert (status.outcome, status.reason, status.ending) == ("clean", "", "completed")
    assert read_outcome(run)["outcome"] == "clean"
    assert run.log is None


def test_lost_samples_make_the_run_lossy(run):
    run._recording_thread.lost = {"force": 3}
    status = execute(run)
    assert (status.outcome, status.lost) == ("lossy", {"force": 3})
    assert read_outcome(run)["outcome"] == "lossy"


def test_trip_is_the_reason_whatever_it_caused(run):
    run.sequencer.play = raising(ZeroDivisionError("division by zero"))
    status = execute(run, trip=Trip("force 1600 N"))
    assert (status.outcome, status.reason, status.ending) == ("incomplete", "force 1600 N", "tripped")


def test_stopped_run_is_incomplete(run):
    run.stop("stopped on request", False, "stopped")
    status = execute(run)
    assert (status.outcome, status.reason, status.ending) == ("incomplete", "stopped on request", "stopped")


def test_paused_run_is_stopped_at_its_checkpoint(run):
    run.pause()
    assert run.get_status().pause == "at checkpoint 10mm_1Hz_0.2V"
    status = execute(run)
    assert (status.outcome, status.ending) == ("incomplete", "stopped")
    assert (status.reason, status.pause) == ("paused at checkpoint 10mm_1Hz_0.2V", "")
    assert status.paused_after == "10mm_1Hz_0.2V"


def test_only_a_run_that_a_pause_ended_names_its_checkpoint(run):
    run.pause()
    assert run.get_status().paused_after == ""
    run.stop("stopped on request", False, "stopped")
    assert execute(run).paused_after == ""


def test_pause_without_a_later_checkpoint_takes_effect_after_the_run(run):
    run.sequencer.pause = lambda: None
    run.history.find_progress = lambda now_ns: (run.request.programme.duration - 1.0, -1)
    run.pause()
    assert run.get_status().pause == "after the run, because no checkpoint follows"
    assert execute(run).ending == "completed"


def test_abort_by_a_person_is_not_a_trip_by_an_interlock(run):
    status = execute(run, trip=Trip("aborted by a person", by_person=True))
    assert (status.outcome, status.reason, status.ending) == ("incomplete", "aborted by a person", "aborted")


def test_first_stop_gives_reason_and_ending(run):
    """A person presses stop after the bench has begun a controlled stop by itself."""
    run.stop("coil too hot", True, "tripped")
    run.stop("stopped on request", False, "stopped")
    status = execute(run)
    assert (status.reason, status.ending) == ("coil too hot", "tripped")
    assert read_outcome(run)["ending"] == "tripped"


def test_internal_error_during_playback_closes_the_log(run):
    run.sequencer.play = raising(ZeroDivisionError("division by zero"))
    status = execute(run)
    assert status.outcome == "incomplete"
    assert "ZeroDivisionError" in status.reason
    assert "ZeroDivisionError" in read_outcome(run)["reason"]


def test_samples_before_an_error_are_in_the_log(run):
    def play():
        write_samples(run)
        raise ZeroDivisionError

    run.sequencer.play = play
    execute(run)
    log = read_log(run.request.path)
    assert log.outcome == "incomplete"
    assert len(log.samples["time"]) == 200


def test_internal_error_while_the_log_is_closed_does_not_leave_the_run_in_progress(run):
    status = execute(run, raising(KeyError("lvdt")))
    assert status.outcome == "incomplete"
    assert "the log could not be finalised: KeyError" in status.reason
    assert read_outcome(run)["reason"] == status.reason


def test_log_that_cannot_be_opened_fails_the_run(run, tmp_path):
    (tmp_path / "a.mcap").mkdir()
    status = execute(run)
    assert status.outcome == "incomplete"
    assert "a.mcap" in status.reason


def test_failure_outside_of_the_playback_finalises_the_log(run):
    """The supervisor fails while the log is open, and the run slot fails the run."""
    run.sequencer.play = lambda: write_samples(run)
    with pytest.raises(ZeroDivisionError):
        run.execute(LogMetadata(header(), [], lambda: DECODERS, dict), raising(ZeroDivisionError()), {})
    assert run.get_status().outcome is None
    run.fail("the run failed: no supervision")
    status = run.get_status()
    assert (status.outcome, status.reason) == ("incomplete", "the run failed: no supervision")
    log = read_log(run.request.path)
    assert (log.outcome, len(log.samples["time"])) == ("incomplete", 200)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS])
def test_disk_that_takes_no_more_ends_the_run_with_its_cause(run, monkeypatch, code):
    """A file layer that fails from one moment on, as on a full disk or one that became read-only."""
    disk = FailingDisk(monkeypatch)

    def play():
        write_samples(run)
        run.log._write_queue()
        run.log._log._file.sync()
        disk.error = OSError(code, os.strerror(code))
        write_samples(run, first=1_000_000_000)

    run.sequencer.play = play
    status = execute(run)
    # The disk failed after the last stroke: the run was completed, its log was not.
    assert (status.outcome, status.ending) == ("incomplete", "completed")
    assert os.strerror(code).lower() in status.reason
    salvage_log(run.request.path)
    assert len(read_log(run.request.path).samples["time"]) == 200


def test_later_failure_does_not_change_the_outcome(run):
    execute(run)
    run.fail("too late")
    assert (run.get_status().outcome, run.get_status().reason) == ("clean", "")


def test_log_of_an_agent_that_was_killed_can_be_salvaged(run, tmp_path):
    """The file is copied while the run writes it, as a kill would leave it."""
    copy = tmp_path / "killed.mcap"

    def play():
        write_samples(run)
        run.log._write_queue()
        run.log._log._file.sync()
        copy.write_bytes(run.request.path.read_bytes())

    run.sequencer.play = play
    execute(run)
    with pytest.raises(LogError, match="mrbench salvage"):
        read_log(copy)
    salvage_log(copy)
    log = read_log(copy)
    assert log.outcome == "truncated"
    assert log.metadata["run"]["id"] == "run-1"
    assert len(log.samples["time"]) > 0


def test_status_of_a_run_without_outcome_shows_its_progress(run):
    status = run.get_status()
    assert (status.outcome, status.reason, status.elapsed_s) == (None, "", 0.0)
    assert status.duration_s == pytest.approx(run.request.programme.duration)


def test_samples_are_recorded_for_a_fifth_of_a_second_after_the_rest(run):
    """The rod is at rest at 5 s, so samples up to 5.2 s are awaited."""
    newest = iter([5_199_999_999, 5_200_000_000])

    class Recording(FakeRecordingThread):
        newest_ns = property(lambda self: next(newest))

    run._recording_thread, run._timing = Recording(), AgentTiming(final_samples=10.0)
    run._clock = lambda: 5_000_000_000
    assert execute(run).outcome == "clean"
    assert list(newest) == []
