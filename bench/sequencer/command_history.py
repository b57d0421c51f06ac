"""Command history of a run: displacement, drive and segment commanded at each instant of the bench clock.

The sequencer adds each scheduled trajectory when its first setpoint is sent, and replaces it when it is stopped.
The recorder and the supervisor read the history meanwhile; entries are immutable.
"""

import math
import threading
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.methods import NO_SEGMENT
from bench.sequencer.playback import Indices, PlaybackSection
from bench.sequencer.trajectory import Array, ScheduledTrajectory, Times

_DISTANT_FUTURE_NS = 2**62
"""[ns] Instant after all others."""


@dataclass(frozen=True)
class CommandEntry:
    """Scheduled trajectory, which applies from its begin until the begin of the next entry."""

    schedule: ScheduledTrajectory
    section: PlaybackSection | None = None
    """Section of the programme; None on the way to its start."""


class CommandedValues(NamedTuple):
    """Commands at several instants, each array of shape (samples,)."""

    displacement: Array
    """[m]; NaN before the first command."""
    drive: Array
    """[V or A]"""
    segment: Indices
    """Index of the programme's segment; -1 between segments."""


class CommandHistory:
    """Commands of one run; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._entries: list[CommandEntry] = []
        self._off_ns: int | None = None

    @property
    def entries(self) -> tuple[CommandEntry, ...]:
        """All entries in order of time."""
        with self._lock:
            return tuple(self._entries)

    @property
    def has_started(self) -> bool:
        """True if the programme has begun; the move to its start does not count."""
        return any(entry.section is not None for entry in self.entries)

    def add(self, entry: CommandEntry) -> None:
        """Add an entry; one with the same begin as the last entry replaces it."""
        with self._lock:
            if self._entries and self._entries[-1].schedule.begin_ns == entry.schedule.begin_ns:
                self._entries.pop()
            self._entries.append(entry)

    def switch_off(self, now_ns: int) -> None:
        """Set drive to zero and segment to none from an instant on [ns]; only the first call counts."""
        with self._lock:
            self._off_ns = now_ns if self._off_ns is None else self._off_ns

    def find_progress(self, now_ns: int) -> tuple[float, int]:
        """Return the completed time of the programme [s] and the index of the current segment, or -1."""
        last = next((entry for entry in reversed(self.entries) if entry.section is not None), None)
        if last is None or last.section is None:
            return 0.0, NO_SEGMENT
        sample = int(last.section.find_samples(last.schedule.map_time(np.array([now_ns])))[0])
        is_off = self._off_ns is not None and now_ns >= self._off_ns
        elapsed = last.section.programme.time[sample]
        return float(elapsed), NO_SEGMENT if is_off else int(last.section.programme.segment[sample])

    def has_reached(self, sample: int, now_ns: int) -> bool:
        """Return whether a sample of the programme was due at an instant [ns], soft stops disregarded."""
        for entry in reversed(self.entries):
            if entry.section is not None and entry.schedule.begin_ns <= now_ns:
                since = np.array([(now_ns - entry.schedule.begin_ns) * 1e-9])
                return int(entry.section.find_samples(since)[0]) >= sample
        return False

    def find_position(self, time_ns: int) -> float:
        """Return the position [m] commanded at an instant [ns] of the bench clock; NaN before the first one."""
        for entry in reversed(self.entries):
            if entry.schedule.begin_ns <= time_ns:
                return entry.schedule.find_position(time_ns)
        return math.nan

    def find_commands(self, time_ns: Times) -> CommandedValues:
        """Return the commands at increasing instants of the bench clock [ns]."""
        values = CommandedValues(
            np.full(len(time_ns), np.nan),
            np.zeros(len(time_ns)),
            np.full(len(time_ns), NO_SEGMENT, dtype=np.int64),
        )
        entries = self.entries
        for index, entry in enumerate(entries):
            is_last = index + 1 == len(entries)
            end_ns = _DISTANT_FUTURE_NS if is_last else entries[index + 1].schedule.begin_ns
            applies = (time_ns >= entry.schedule.begin_ns) & (time_ns < end_ns)
            if applies.any():
                self._fill(values, applies, entry, time_ns[applies])
        return values

    def _fill(
        self, values: CommandedValues, applies: npt.NDArray[np.bool_], entry: CommandEntry, time_ns: Times
    ) -> None:
        values.displacement[applies] = entry.schedule.find_positions(time_ns)
        if entry.section is None:
            return
        # The amplifier's table continues by its own time during a soft stop, but the coil is switched off with it.
        elapsed = np.asarray((time_ns - entry.schedule.begin_ns) * 1e-9, dtype=np.float64)
        samples = entry.section.find_samples(elapsed)
        is_on = np.full(len(time_ns), True) if self._off_ns is None else time_ns < self._off_ns
        values.drive[applies] = np.where(is_on, entry.section.programme.drive[samples], 0.0)
        in_section = is_on & (elapsed < entry.section.trajectory.duration)
        values.segment[applies] = np.where(in_section, entry.section.programme.segment[samples], NO_SEGMENT)
