"""One run: its playback, its recording and its result."""

import contextlib
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime

from bench.agent.run_request import RunRequest
from bench.agent.timing import OPERATION_TIMING, AgentTiming
from bench.agent_protocol import RunOutcome, RunStatus
from bench.endings import RunEnding
from bench.errors import BenchError
from bench.methods import NO_SEGMENT
from bench.recorder import EventReporter, LiveRecorder, LogMetadata, RecordingThread, RunRecorder
from bench.rig import ClockMap
from bench.safety import Trip
from bench.sequencer import CommandHistory, Sequencer, find_checkpoint_samples
from drivers import Clock, DriverError

_POST_RUN_TIME = 0.2
"""[s] Time that is recorded after everything is at rest."""
_POLL_PERIOD = 0.02
"""[s] Interval of polling while waiting."""


class Run:
    """One run on the rig.

    Args:
        request: the run to execute.
        history: commands of the run.
        sequencer: plays the programme.
        recording_thread: records the samples.
        clock: bench clock [ns].
        report_event: receives the events of the run.
        timing: waiting times.
    """

    def __init__(
        self,
        request: RunRequest,
        history: CommandHistory,
        sequencer: Sequencer,
        recording_thread: RecordingThread,
        clock: Clock,
        report_event: EventReporter,
        timing: AgentTiming = OPERATION_TIMING,
    ) -> None:
        self.request, self.history, self.sequencer = request, history, sequencer
        self._recording_thread, self._clock, self._report_event = recording_thread, clock, report_event
        self._timing = timing
        self._log: LiveRecorder | None = None
        self._reason = ""
        self._pause_requested = False
        self._stop_ending: RunEnding = "tripped"
        self._ending: RunEnding | None = None
        self._outcome: RunOutcome | None = None
        self._lost: dict[str, int] = {}
        self._started = datetime.now(UTC)
        self._method_sha256 = request.method.compute_sha256()

    @property
    def log(self) -> LiveRecorder | None:
        """Log of the run while it is open."""
        return self._log

    def stop(self, reason: str, hold: bool, ending: RunEnding) -> None:
        """Stop the run softly; from any thread, harmless if repeated.

        Args:
            reason: for a person; the first one is kept.
            hold: keep the rod at its position until the next stop without it.
            ending: ending of the run; the first one is kept.
        """
        if not self.sequencer.stop_reason:
            self._stop_ending = ending
        self.sequencer.stop(reason, hold)

    def pause(self) -> None:
        """End the run at its next checkpoint; from any thread, without effect if none follows."""
        self._pause_requested = True
        self.sequencer.pause()

    def execute(
        self,
        metadata: LogMetadata,
        wait_until_stopped: Callable[[], Trip | None],
        maps: Mapping[str, ClockMap],
    ) -> None:
        """Play and record the run; return when everything is at rest and the log is closed.

        Args:
            metadata: content of the log apart from samples, marks and events.
            wait_until_stopped: waits for the end of a trip; returns the trip, None without one.
            maps: clock maps of the instruments by name.
        """
        try:
            self._log = LiveRecorder(self.request.path, metadata.header, maps=maps)
        except BenchError as error:
            self.fail(str(error))
            return
        failure = self._try_play(metadata, self._log)
        self._reason, self._ending = self._conclude(wait_until_stopped(), failure)
        self._await_samples(self._clock() + round(_POST_RUN_TIME * 1e9))
        try:
            self._close(self._log, metadata.describe_clocks)
        except Exception as error:  # without an outcome the run would seem to be in progress
            self.fail(
                f"the log could not be finalised: {error!r}; repair it with mrbench salvage; "
                "internal error, please report"
            )

    def fail(self, reason: str) -> None:
        """End the run as incomplete and close its log; without effect if the run has an outcome."""
        if self._outcome is not None:
            return
        self._reason, self._ending = reason, "tripped"
        log, self._log = self._log, None
        if log is not None:
            with contextlib.suppress(Exception):
                self._lost = self._recording_thread.finish_recording()
            with contextlib.suppress(Exception):
                log.close("incomplete", reason, "tripped")
        self._outcome = "incomplete"

    def get_status(self) -> RunStatus:
        """Return progress or result."""
        request, method = self.request, self.request.method
        elapsed, segment = self.history.find_progress(self._clock())
        cycle = request.programme.find_cycle(segment, elapsed)
        is_over = self._outcome is not None
        return RunStatus(
            id=request.identity.make_run_id(method.name),
            method=method.name,
            method_sha256=self._method_sha256,
            specimen=request.identity.specimen,
            operator=request.identity.operator,
            log=str(request.path),
            started=self._started.isoformat(),
            duration_s=request.programme.duration,
            elapsed_s=elapsed,
            segment="" if is_over or segment == NO_SEGMENT else request.programme.segments[segment].name,
            cycle=None if is_over or cycle is None else cycle[0],
            cycles=None if is_over or cycle is None else cycle[1],
            outcome=self._outcome,
            ending=self._ending if is_over else None,
            reason=self._reason if is_over else "",
            continues=request.continues,
            calibration_overdue=request.overdue,
            failed_checks=request.failed_checks,
            pause="" if is_over else self._describe_pause(elapsed),
            paused_after=self.sequencer.paused_after if is_over and self._is_paused else "",
            lost=self._lost if is_over else self._recording_thread.count_lost(),
        )

    @property
    def _is_paused(self) -> bool:
        """True if a pause ended the run: neither a stop nor a trip did."""
        return self._ending == "stopped" and not self.sequencer.stop_reason

    def _describe_pause(self, elapsed: float) -> str:
        """Return when a requested pause takes effect, from the completed time of the plan [s]."""
        if not self._pause_requested:
            return ""
        programme = self.request.programme
        samples = find_checkpoint_samples(programme)
        name = next((name for sample, name in sorted(samples.items()) if programme.time[sample] > elapsed), "")
        return f"at checkpoint {name}" if name else "after the run, because no checkpoint follows"

    def _conclude(self, trip: Trip | None, failure: str) -> tuple[str, RunEnding]:
        """Return reason and ending of the run; a trip comes first, because it also makes the setpoints fail."""
        if trip is not None:
            return trip.reason, "aborted" if trip.by_person else "tripped"
        if failure:
            return failure, "tripped"
        if reason := self.sequencer.stop_reason:
            return reason, self._stop_ending
        if name := self.sequencer.paused_after:
            return f"paused at checkpoint {name}", "stopped"
        return "", "completed"

    def _try_play(self, metadata: LogMetadata, log: LiveRecorder) -> str:
        """Play the run; return the reason of a failure, empty without one."""
        try:
            self._play(metadata, log)
        except (BenchError, DriverError) as error:
            return str(error)
        except Exception as error:  # whatever happened, the log is closed and the next run can begin
            return f"the run failed: {error!r}; internal error, please report"
        return ""

    def _play(self, metadata: LogMetadata, log: LiveRecorder) -> None:
        for attachment in [*metadata.attachments, metadata.describe_decoders()]:
            log.attach(attachment.name, attachment.media_type, attachment.data)
        programme = self.request.programme
        self._recording_thread.start_recording(
            RunRecorder(log, programme, self.history, self._report_event, self._clock())
        )
        resumed = f", resumed after segment {self.request.resumed_after}" if self.request.resumed_after else ""
        self._report_event("state", f"run of method {self.request.method.name} started{resumed}")
        for text in self.request.failed_checks:
            self._report_event("check", text)
        self.sequencer.run(programme)

    def _await_samples(self, until_ns: int) -> None:
        """Wait for samples up to an instant [ns]; if a channel has failed, until the timeout."""
        deadline = time.monotonic() + self._timing.final_samples
        while self._recording_thread.newest_ns < until_ns and time.monotonic() < deadline:
            time.sleep(_POLL_PERIOD)

    def _close(self, log: LiveRecorder, describe_clocks: Callable[[], dict[str, str]]) -> None:
        self._report_event("state", "run finished" if not self._reason else f"run ended: {self._reason}")
        lost = self._recording_thread.finish_recording()
        for channel, count in lost.items():
            log.count_lost(channel, count)
        lost = {**lost, **log.dropped_counts}
        outcome: RunOutcome = "incomplete"
        try:
            log.write_clocks(describe_clocks())
            closed = log.close("incomplete" if self._reason else None, self._reason, self._ending)
            outcome = "incomplete" if closed == "truncated" else closed
        except BenchError as error:
            self._reason = str(error)
        self._lost = lost
        # Last, because a status with an outcome is taken as final.
        self._outcome = outcome
        self._log = None
