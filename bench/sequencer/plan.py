"""What a run asks for at each instant of the bench clock, beside what the rig does: commands and segments.

Grows while the run goes on: each passage is entered when its first setpoint has left, and shortened when it is
stopped. Written by the sequencer, read by the recorder; every entry is frozen.
"""

import math
import threading
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.methods.compile import BETWEEN
from bench.sequencer.passages import Indices, Passage
from bench.sequencer.track import Array, Playing, Times


@dataclass(frozen=True)
class Entry:
    """What is played from ``playing.begin_ns`` on, until the next entry."""

    playing: Playing
    passage: Passage | None = None
    """The part of the programme; none on the way to its begin."""


class Commands(NamedTuple):
    """Each of shape (samples,)."""

    displacement: Array
    """[m]; NaN before anything was commanded."""
    drive: Array
    """[V or A]"""
    segment: Indices
    """Index of the programme's segment; -1 between."""


class RunPlan:
    """The entries of one run."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._entries: list[Entry] = []
        self._off_ns: int | None = None

    @property
    def entries(self) -> tuple[Entry, ...]:
        """So far."""
        with self._lock:
            return tuple(self._entries)

    def enter(self, entry: Entry) -> None:
        """What is played from now on; the same passage, stopped, takes the place of itself."""
        with self._lock:
            if self._entries and self._entries[-1].playing.begin_ns == entry.playing.begin_ns:
                self._entries.pop()
            self._entries.append(entry)

    def switch_off(self, now_ns: int) -> None:
        """The coil goes to zero and no segment goes on from now on [ns]."""
        with self._lock:
            self._off_ns = now_ns if self._off_ns is None else self._off_ns

    def progress(self, now_ns: int) -> tuple[float, int]:
        """[s] of the programme that are done, and the index of the segment that runs, or -1."""
        last = next((entry for entry in reversed(self.entries) if entry.passage is not None), None)
        if last is None or last.passage is None:
            return 0.0, BETWEEN
        sample = int(last.passage.samples_at(last.playing.place(np.array([now_ns])))[0])
        off = self._off_ns is not None and now_ns >= self._off_ns
        done = last.passage.programme.time[sample]
        return float(done), BETWEEN if off else int(last.passage.programme.segment[sample])

    def reached(self, sample: int, now_ns: int) -> bool:
        """Whether the programme's ``sample`` was due at an instant [ns], had nothing been stopped."""
        for entry in reversed(self.entries):
            if entry.passage is not None and entry.playing.begin_ns <= now_ns:
                since = np.array([(now_ns - entry.playing.begin_ns) * 1e-9])
                return int(entry.passage.samples_at(since)[0]) >= sample
        return False

    def position(self, time_ns: int) -> float:
        """Where the rod was sent at an instant of the bench clock [ns]: [m]; NaN before the first setpoint."""
        for entry in reversed(self.entries):
            if entry.playing.begin_ns <= time_ns:
                return entry.playing.position(time_ns)
        return math.nan

    def at(self, time_ns: Times) -> Commands:
        """Commands at instants of the bench clock, increasing."""
        found = Commands(
            np.full(len(time_ns), np.nan), np.zeros(len(time_ns)), np.full(len(time_ns), BETWEEN, dtype=np.int64)
        )
        entries = self.entries
        for index, entry in enumerate(entries):
            until = entries[index + 1].playing.begin_ns if index + 1 < len(entries) else 2**62
            here = (time_ns >= entry.playing.begin_ns) & (time_ns < until)
            if here.any():
                self._fill(found, here, entry, time_ns[here])
        return found

    def _fill(self, found: Commands, here: npt.NDArray[np.bool_], entry: Entry, time_ns: Times) -> None:
        found.displacement[here] = entry.playing.positions(time_ns)
        if entry.passage is None:
            return
        # The amplifier's table runs on while the motion fades out; the coil is switched off at the same moment.
        place = np.asarray((time_ns - entry.playing.begin_ns) * 1e-9, dtype=np.float64)
        samples = entry.passage.samples_at(place)
        on = np.full(len(time_ns), True) if self._off_ns is None else time_ns < self._off_ns
        found.drive[here] = np.where(on, entry.passage.programme.drive[samples], 0.0)
        counts = on & (place < entry.passage.track.duration)
        found.segment[here] = np.where(counts, entry.passage.programme.segment[samples], BETWEEN)
