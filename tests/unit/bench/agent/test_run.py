"""One run whose parts fail: its outcome, and the log that it leaves."""

import itertools
from datetime import UTC, datetime

import pytest
from mcap.reader import make_reader

from bench.agent.run import Run
from bench.agent.run_request import RunRequest
from bench.agent.timing import AgentTiming
from bench.errors import LogError
from bench.log import Identity
from bench.log.reader import read_log
from bench.log.salvage import salvage_log
from bench.methods import compile_method, load_method
from bench.recorder.bench_header import Attachment, LogMetadata
from bench.sequencer.command_history import CommandHistory
from tests.support.fake_rig import EventLog, FakeRecordingThread
from tests.support.logs import header, times, values

DECODERS = Attachment("decoders.json", "application/json", b"{}")


class FakeSequencer:
    """Sequencer that plays nothing, or raises an error after samples were recorded."""

    def __init__(self):
        self.stop_reason, self.play = "", lambda: None

    def run(self, programme, first):
        self.play()


def raising(error):
    def fail():
        raise error

    return fail


@pytest.fixture
def run(tmp_path):
    ticks = itertools.count()
    identity = Identity("D1", "", datetime.now(UTC))
    request = RunRequest(compile_method(load_method("quick")), 0, identity, tmp_path / "a.mcap")
    return Run(
        request, CommandHistory(), FakeSequencer(), FakeRecordingThread(), lambda: next(ticks), EventLog(),
        AgentTiming(final_samples=0.0),
    )  # fmt: skip


def execute(run, clocks=dict, trip_reason=""):
    run.execute(LogMetadata(header(), [], lambda: DECODERS, clocks), lambda: trip_reason, {})
    return run.get_status()


def read_outcome(run):
    with run.request.path.open("rb") as file:
        return next(one.metadata for one in make_reader(file).iter_metadata() if one.name == "outcome")


def write_samples(run, samples=200):
    time_ns = times(samples, first=1)
    run.log.write_samples(time_ns, values(samples))


def test_run_and_log_have_the_same_outcome(run):
    status = execute(run)
    assert (status.outcome, status.reason) == ("clean", "")
    assert read_outcome(run)["outcome"] == "clean"
    assert run.log is None


def test_lost_samples_make_the_run_lossy(run):
    run._recording_thread.lost = {"force": 3}
    status = execute(run)
    assert (status.outcome, status.lost) == ("lossy", {"force": 3})
    assert read_outcome(run)["outcome"] == "lossy"


def test_trip_is_the_reason_whatever_it_caused(run):
    run.sequencer.play = raising(ZeroDivisionError("division by zero"))
    status = execute(run, trip_reason="force 1600 N")
    assert (status.outcome, status.reason) == ("incomplete", "force 1600 N")


def test_stopped_run_is_incomplete(run):
    run.sequencer.stop_reason = "stopped on request"
    status = execute(run)
    assert (status.outcome, status.reason) == ("incomplete", "stopped on request")


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
