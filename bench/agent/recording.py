"""One run's log while it grows: bench samples with what was commanded, segments where they truly began and ended.

Whoever acquires hands in samples; here each is given its command and its segment by the run's plan. Marks and
checkpoints follow from the samples themselves, so they stand among them where they belong.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from bench.methods import Programme, ProgrammeSegment
from bench.methods.compile import BETWEEN
from bench.recorder.live import LiveRecorder
from bench.recorder.messages import Phase
from bench.rig.alignment import AlignedSamples
from bench.sequencer.plan import RunPlan
from bench.sequencer.track import Times

Columns: TypeAlias = dict[str, npt.NDArray[np.float64]]
"""By field of a bench sample, each of shape (samples,); NaN where there is no value."""
Tell: TypeAlias = Callable[[int, str, str], None]
"""Told of an event: bench clock [ns], kind, words."""


_NEXT_NS = 5_000_000
"""[ns] after the last sample of a segment within which the next one comes."""


class Recording:
    """The samples of one run.

    Args:
        log: open; whoever opened it closes it.
        programme: that is run.
        plan: what was commanded when.
        tell: told of segments and checkpoints.
        begin_ns: bench clock [ns] before which samples are not recorded.
    """

    def __init__(self, log: LiveRecorder, programme: Programme, plan: RunPlan, tell: Tell, begin_ns: int) -> None:
        self.log = log
        self.newest_ns = -1
        """Bench clock of the newest sample [ns]."""
        self.finished: set[int] = set()
        """Index of each segment that was recorded to its end."""
        self._programme, self._plan, self._tell = programme, plan, tell
        self._segment = BETWEEN
        self._begin_ns = begin_ns

    @property
    def segment(self) -> str:
        """Name of the segment of the newest sample; empty between segments."""
        return "" if self._segment == BETWEEN else self._programme.segments[self._segment].name

    def take(self, aligned: AlignedSamples) -> Columns:
        """Record samples made since recording began; returns the columns of all with what was commanded."""
        time_ns = aligned.time_ns
        commands = self._plan.at(time_ns)
        segment = commands.segment
        columns = {
            **aligned.columns,
            "displacement_command": commands.displacement,
            "coil_drive_command": commands.drive,
            "segment": segment.astype(np.float64),
        }
        self._record(time_ns, columns, segment)
        return columns

    def _record(self, time_ns: Times, columns: Columns, segment: Times) -> None:
        # Samples come some tens of milliseconds late: the first ones handed in are of before the run.
        first = int(np.searchsorted(time_ns, self._begin_ns))
        if first == len(time_ns):
            return
        time_ns, segment = time_ns[first:], segment[first:]
        columns = {name: column[first:] for name, column in columns.items()}
        before = np.concatenate([[self._segment], segment[:-1]])
        changes = [int(row) for row in np.flatnonzero(segment != before)]
        for start, stop in zip([0, *changes], [*changes, len(time_ns)], strict=True):
            if start in changes:
                self._change(int(time_ns[start]), int(before[start]), int(segment[start]))
            if stop > start:
                part = slice(start, stop)
                self.log.samples(time_ns[part], {name: column[part] for name, column in columns.items()})
                self.newest_ns = int(time_ns[stop - 1])
        self._segment = int(segment[-1])

    def end(self) -> None:
        """No sample comes any more: a segment that was cut short ends here."""
        if self._segment != BETWEEN:
            self._mark(self.newest_ns, "end", self._programme.segments[self._segment])
            self._segment = BETWEEN

    def _change(self, time_ns: int, before: int, after: int) -> None:
        """One segment ends with the sample before, another one begins with this sample."""
        segments = self._programme.segments
        if before != BETWEEN:
            ended = segments[before]
            self._mark(self.newest_ns, "end", ended)
            if self._whole(ended):
                self.finished.add(before)
                if ended.checkpoint:
                    self._tell(self.newest_ns, "checkpoint", f"after segment {ended.name}")
        if after != BETWEEN:
            self._mark(time_ns, "start", segments[after])
            self._tell(time_ns, "state", f"segment {segments[after].name} started")

    def _whole(self, segment: ProgrammeSegment) -> bool:
        """Whether it came to its planned end, and was not cut off by a stop."""
        return self._plan.reached(segment.stop, self.newest_ns + _NEXT_NS)

    def _mark(self, time_ns: int, phase: Phase, segment: ProgrammeSegment) -> None:
        self.log.segment(
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
        )
