"""A programme cut into passages, each of which begins and ends at rest and whose drive fits the amplifier's table.

The amplifier runs the steps of the drive by its own clock, exactly, but its table holds only so many, and its
clock is not the bench's. Where a programme has more, or is long, the rod waits for a moment at a place where it
rests anyway while the next part is brought up.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.errors import RunError
from bench.methods import Programme
from bench.methods.compile import BETWEEN
from bench.sequencer.track import Array, Times, Track

LONGEST = 60.0
"""[s] of a passage, where the programme rests often enough: the amplifier's clock and the bench's part by some 50
microseconds a second, and each passage sets them off together again."""
_AT_REST = 1e-6
"""[m/s] below which a programme stands."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Passage:
    """The samples of a programme from ``start`` to ``stop``, both included."""

    programme: Programme
    start: int
    stop: int

    @property
    def track(self) -> Track:
        """Its motion."""
        part, of = slice(self.start, self.stop + 1), self.programme
        return Track(of.rate, of.displacement[part], of.velocity[part], of.acceleration[part])

    def steps(self) -> tuple[Array, Array]:
        """Times [s] from its begin and levels [V or A] of the drive, the first at its begin."""
        drive = self.programme.drive[self.start : self.stop + 1]
        places = np.concatenate([[0], np.flatnonzero(np.diff(drive)) + 1])
        return places / self.programme.rate, drive[places]

    def samples_at(self, place: Array) -> Indices:
        """Index of the programme's sample that holds at times [s] from the passage's begin."""
        # An instant that rounding puts this little before a sample still belongs to it.
        index = np.floor(place * self.programme.rate + 1e-6).astype(np.int64)
        return self.start + np.clip(index, 0, self.stop - self.start)


def passages(programme: Programme, capacity: int, first: int = 0) -> tuple[Passage, ...]:
    """The passages of a programme, as few as its steps of drive allow.

    Args:
        programme: compiled.
        capacity: steps that the amplifier's table holds.
        first: sample to begin with, at rest.

    Raises:
        RunError: between two moments of rest the drive changes more often than the table holds.
    """
    steps = np.concatenate([[0], np.cumsum(np.diff(programme.drive) != 0)])
    rests = [int(sample) for sample in resting(programme) if sample > first]
    found, start = [], first
    while start < len(programme.time) - 1:
        later = [rest for rest in rests if rest > start]
        # The level at its begin takes a place of the table, too: as many changes as it holds are one too many.
        fitting = [rest for rest in later if steps[rest] - steps[start] < capacity]
        if not fitting:
            raise _too_many(programme, steps, start, later[0], capacity)
        short = [rest for rest in fitting if rest - start <= LONGEST * programme.rate]
        # Where it rests too seldom, the first rest after LONGEST is the best that can be had.
        stop = short[-1] if short else fitting[0]
        found.append(Passage(programme, start, stop))
        start = stop
    return tuple(found)


def resting(programme: Programme) -> Times:
    """Samples at which the motion stands and no segment is cut: a run may wait there. The last one always is."""
    still = np.abs(programme.velocity) < _AT_REST
    between = programme.segment == BETWEEN
    edge = np.concatenate([[True], np.diff(programme.segment) != 0])
    found = still & (between | edge)
    found[-1] = True
    return np.flatnonzero(found)


def after_segment(programme: Programme, name: str) -> int:
    """The sample from which a run goes on that was interrupted after a segment.

    Raises:
        RunError: there is no such segment, or nothing comes after it, or it is no checkpoint.
    """
    known = {segment.name: segment for segment in programme.segments if segment.checkpoint}
    if name not in known:
        there = ", ".join(known) or "none"
        raise RunError(f"method {programme.method.name} has no checkpoint after {name}; its checkpoints: {there}")
    later = [int(sample) for sample in resting(programme) if sample >= known[name].stop]
    if later[0] >= len(programme.time) - 1 or known[name] is programme.segments[-1]:
        raise RunError(f"method {programme.method.name}: nothing comes after segment {name}; the run was complete")
    return later[0]


def _too_many(programme: Programme, steps: Indices, start: int, stop: int, capacity: int) -> RunError:
    count = int(steps[stop] - steps[start]) + 1
    inside = [segment.name for segment in programme.segments if start <= segment.start <= stop]
    where = f"segment {inside[0]}" if inside else f"from {programme.time[start]:.1f} s on"
    return RunError(
        f"method {programme.method.name}, {where}: the drive takes {count} values before the rod rests again, and "
        f"the coil amplifier's table holds {capacity}; shorten the segment, lower rate_hz, or use steps"
    )
