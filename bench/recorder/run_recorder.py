"""Run recorder: writes the bench samples of one run with their commands and segment marks.

Commands and segments come from the run's command history. Segment marks and checkpoints follow from the samples,
so they are placed between the samples to which they belong.
"""

from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from bench.log import Phase
from bench.methods import NO_SEGMENT, Programme, ProgrammeSegment
from bench.recorder.live_recorder import LiveRecorder
from bench.rig import AlignedSamples
from bench.sequencer import CommandHistory, Times

Columns: TypeAlias = dict[str, npt.NDArray[np.float64]]
"""By field of a bench sample, each of shape (samples,); NaN for a missing value."""

_MAX_GAP_NS = 5_000_000
"""[ns] Time after the last sample of a segment within which the next sample is expected."""


class EventReporter(Protocol):
    """Receiver of events of a run or of the agent."""

    def __call__(self, kind: str, text: str, time_ns: int | None = None, **details: Any) -> None:
        """Report an event.

        Args:
            kind: state, command, alarm, trip, late, checkpoint or run_finished.
            text: description for a person.
            time_ns: bench clock of the event [ns]; now if None.
            details: further fields of the event in the log.
        """


class RunRecorder:
    """Recorder of one run.

    Args:
        log: open log, which its owner closes.
        programme: programme of the run.
        history: commands of the run.
        report_event: receives segments and checkpoints.
        begin_ns: bench clock [ns] before which samples are not recorded.
    """

    def __init__(
        self,
        log: LiveRecorder,
        programme: Programme,
        history: CommandHistory,
        report_event: EventReporter,
        begin_ns: int,
    ) -> None:
        self._log = log
        self._newest_ns = -1
        self._programme, self._history, self._report_event = programme, history, report_event
        self._segment = NO_SEGMENT
        self._begin_ns = begin_ns

    @property
    def segment(self) -> str:
        """Name of the segment of the newest sample; empty between segments."""
        return "" if self._segment == NO_SEGMENT else self._programme.segments[self._segment].name

    def add_samples(self, aligned: AlignedSamples) -> Columns:
        """Record the samples since the begin of the recording; return the columns of all with their commands."""
        time_ns = aligned.time_ns
        commands = self._history.find_commands(time_ns)
        segment = commands.segment
        columns = {
            **aligned.columns,
            "displacement_command": commands.displacement,
            "coil_drive_command": commands.drive,
            "segment": segment.astype(np.float64),
        }
        self._record(time_ns, columns, segment)
        return columns

    def finish(self) -> None:
        """Mark the end of a segment that was interrupted, because no more samples will come."""
        if self._segment != NO_SEGMENT:
            self._write_mark(self._newest_ns, "end", self._programme.segments[self._segment])
            self._segment = NO_SEGMENT

    def _record(self, time_ns: Times, columns: Columns, segment: Times) -> None:
        # Samples arrive tens of milliseconds late, so the first ones were taken before the run.
        first = int(np.searchsorted(time_ns, self._begin_ns))
        if first == len(time_ns):
            return
        time_ns, segment = time_ns[first:], segment[first:]
        columns = {name: column[first:] for name, column in columns.items()}
        before = np.concatenate([[self._segment], segment[:-1]])
        changes = {int(row) for row in np.flatnonzero(segment != before)}
        # A change at the first sample must be marked once, so each row is listed once.
        starts = sorted({0, *changes})
        for start, stop in zip(starts, [*starts[1:], len(time_ns)], strict=True):
            if start in changes:
                self._change_segment(int(time_ns[start]), int(before[start]), int(segment[start]))
            part = slice(start, stop)
            self._log.write_samples(time_ns[part], {name: column[part] for name, column in columns.items()})
            self._newest_ns = int(time_ns[stop - 1])
        self._segment = int(segment[-1])

    def _change_segment(self, time_ns: int, before: int, after: int) -> None:
        """Mark the end of a segment at the sample before, and the start of the next one at this sample."""
        segments = self._programme.segments
        if before != NO_SEGMENT:
            ended = segments[before]
            self._write_mark(self._newest_ns, "end", ended)
            if ended.checkpoint and self._is_complete(ended):
                self._report_event("checkpoint", f"after segment {ended.name}", self._newest_ns)
        if after != NO_SEGMENT:
            self._write_mark(time_ns, "start", segments[after])
            self._report_event("state", f"segment {segments[after].name} started", time_ns)

    def _is_complete(self, segment: ProgrammeSegment) -> bool:
        """Return whether a segment reached its planned end and was not interrupted by a stop."""
        return self._history.has_reached(segment.stop, self._newest_ns + _MAX_GAP_NS)

    def _write_mark(self, time_ns: int, phase: Phase, segment: ProgrammeSegment) -> None:
        self._log.write_segment(
            time_ns,
            phase=phase,
            index=segment.index,
            name=segment.name,
            stretch=self._programme.method.name,
            motion=segment.motion,
            drive=segment.drive,
            amplitude=segment.amplitude,
            frequency=segment.frequency,
            drive_value=segment.drive_value,
            shunt=segment.shunt,
        )
