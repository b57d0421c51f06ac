"""Playback sections: parts of a programme that begin and end at rest and whose drive fits the amplifier's table.

The amplifier plays the drive steps exactly, but by its own clock, and its table is limited. A programme with more
steps, or a long one, is therefore split where the rod rests anyway. The rod waits there until the next section is
uploaded, and the shunt of the load cell is switched there.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.errors import RunError
from bench.methods import NO_SEGMENT, Programme
from bench.sequencer.trajectory import Array, Times, Trajectory

MAX_SECTION_TIME = 60.0
"""[s] Longest section, if the programme rests often enough.

The clocks of amplifier and bench diverge by about 50 µs per second; each section starts them together again."""
_REST_VELOCITY = 1e-6
"""[m/s] Threshold on the velocity: below it, a programme is at rest."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class PlaybackSection:
    """Samples of a programme from ``start`` to ``stop``, both included."""

    programme: Programme
    start: int
    stop: int

    @property
    def trajectory(self) -> Trajectory:
        """Motion of the section."""
        part, programme = slice(self.start, self.stop + 1), self.programme
        return Trajectory(
            programme.rate, programme.displacement[part], programme.velocity[part], programme.acceleration[part]
        )

    @property
    def shunt(self) -> bool:
        """True if the shunt of the load cell is on, from the first to the last sample."""
        index = int(self.programme.segment[self.start])
        return index != NO_SEGMENT and self.programme.segments[index].shunt

    @property
    def duration(self) -> float:
        """Planned duration [s]."""
        return (self.stop - self.start) / self.programme.rate

    def list_drive_steps(self) -> tuple[Array, Array]:
        """Return times from the begin [s] and levels [V or A] of the drive steps, the first at the begin."""
        drive = self.programme.drive[self.start : self.stop + 1]
        steps = np.concatenate([[0], np.flatnonzero(np.diff(drive)) + 1])
        return steps / self.programme.rate, drive[steps]

    def find_samples(self, time: Array) -> Indices:
        """Return the indices of the programme's samples in force at times from the begin [s]."""
        # The margin assigns an instant that rounding puts just before a sample to that sample.
        index = np.floor(time * self.programme.rate + 1e-6).astype(np.int64)
        return self.start + np.clip(index, 0, self.stop - self.start)


def split_into_sections(programme: Programme, capacity: int) -> tuple[PlaybackSection, ...]:
    """Split a programme at checkpoints and shunt edges, and further into as few sections as drive steps allow.

    Args:
        programme: compiled method.
        capacity: number of steps in the amplifier's table.

    Raises:
        RunError: between two rests the drive has more steps than the table.
    """
    step_counts = np.concatenate([[0], np.cumsum(np.diff(programme.drive) != 0)])
    rests = [int(sample) for sample in find_rest_samples(programme)]
    last = len(programme.time) - 1
    # Between two sections only, a run can be paused and the shunt switched.
    edges = sorted({*find_checkpoint_samples(programme), *_find_shunt_edges(programme)})
    sections, start = [], 0
    while start < last:
        end = next((sample for sample in edges if sample > start), last)
        later = [rest for rest in rests if start < rest <= end]
        # The level at the begin takes one entry of the table, so the number of changes must be below its capacity.
        fitting = [rest for rest in later if step_counts[rest] - step_counts[start] < capacity]
        if not fitting:
            raise _make_capacity_error(programme, step_counts, start, later[0], capacity)
        short = [rest for rest in fitting if rest - start <= MAX_SECTION_TIME * programme.rate]
        # Without a rest within the longest section time, the first rest after it is used.
        stop = short[-1] if short else fitting[0]
        sections.append(PlaybackSection(programme, start, stop))
        start = stop
    return tuple(sections)


def find_rest_samples(programme: Programme) -> Times:
    """Return the samples at rest where a run may wait without cutting a segment, including the last sample."""
    at_rest = np.abs(programme.velocity) < _REST_VELOCITY
    between = programme.segment == NO_SEGMENT
    edge = np.concatenate([[True], np.diff(programme.segment) != 0])
    may_wait = at_rest & (between | edge)
    may_wait[-1] = True
    return np.flatnonzero(may_wait)


def _find_shunt_edges(programme: Programme) -> set[int]:
    """Return the first sample with the shunt and the first one without it, of each segment with the shunt."""
    return {sample for one in programme.segments if one.shunt for sample in (one.start, one.stop)}


def find_checkpoint_samples(programme: Programme) -> dict[int, str]:
    """Return the names of the checkpoints by the sample at rest where a run can be paused; none after the last."""
    rests = find_rest_samples(programme)
    return {
        int(rests[np.searchsorted(rests, segment.stop)]): segment.name
        for segment in programme.segments[:-1]
        if segment.checkpoint
    }


def _make_capacity_error(programme: Programme, counts: Indices, start: int, stop: int, capacity: int) -> RunError:
    count = int(counts[stop] - counts[start]) + 1
    inside = [segment.name for segment in programme.segments if start <= segment.start <= stop]
    place = f"segment {inside[0]}" if inside else f"from {programme.time[start]:.1f} s on"
    return RunError(
        f"method {programme.method.name}, {place}: the drive takes {count} values before the rod rests again, but "
        f"the coil amplifier's table holds {capacity}; shorten the segment, lower rate_hz, or use steps"
    )
