"""What the refitted law leaves of the force, cut into the pieces that repeat: one cycle of one segment each.

A cycle is the unit of everything that follows: it is held out or fitted whole, and intervals come from drawing
whole cycles anew, because within a cycle the misfit of neighbouring samples is the same thing said twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.piece import Piece
from identification.recordings import Segment, Stretch

Number = TypeVar("Number", bound=np.generic)

_BLOCK = 1.0
"""[s] length of a block where the motion does not repeat."""
_NEARLY = 0.1
"""[cycles] that a segment may lack of another whole one."""
_PERIODIC = ("sine", "triangle")


def by_piece(values: npt.NDArray[Number], pieces: Sequence[Piece]) -> list[npt.NDArray[Number]]:
    """Values (N,) of all pieces one after the other, cut up: (N,) of each."""
    edges = np.cumsum([len(p.force) for p in pieces])[:-1]
    return np.split(values, edges)


@dataclass(frozen=True)
class Condition:
    """One drive at one stroke."""

    drive: float
    """[V or A]"""
    amplitude: float
    """[m]"""
    frequency: float
    """[Hz]; 0 where the motion is not periodic."""


@dataclass(frozen=True)
class Cycles:
    """The cycles of all stretches; arrays of samples are of all stretches one after the other, (N,)."""

    cycle: npt.NDArray[np.intp]
    """(N,) number of the cycle that a sample belongs to; -1 where none."""
    phase: Array
    """(N,) of the stroke [cycles], 0 in the middle going out, 0.25 at the extended end."""
    segment: npt.NDArray[np.intp]
    """(cycles,) number of the segment that a cycle belongs to."""
    conditions: tuple[Condition, ...]
    """(segments,)"""

    @property
    def count(self) -> int:
        """How many cycles there are."""
        return len(self.segment)

    @property
    def strokes(self) -> int:
        """How many strokes of different amplitude or frequency there are."""
        return len({(f"{c.amplitude:.2g}", f"{c.frequency:.2g}") for c in self.conditions if c.frequency})

    def sums(self, values: Array, where: BoolArray) -> Array:
        """(cycles,) sum of values (N,) over the samples of each cycle that are marked."""
        chosen = where & (self.cycle >= 0)
        return np.bincount(self.cycle[chosen], values[chosen], self.count).astype(float)


def cut_cycles(stretches: Sequence[Stretch], pieces: Sequence[Piece]) -> Cycles:
    """The cycles of some stretches.

    Args:
        stretches: with the segments of their method, as far as they are known.
        pieces: of the same stretches, with their smooth motion.
    """
    cycle: list[npt.NDArray[np.intp]] = []
    phases: list[Array] = []
    owner: list[int] = []
    conditions: list[Condition] = []
    cycles = 0
    for stretch, piece in zip(stretches, pieces, strict=True):
        numbers, phase = np.full(len(stretch.time), -1), np.zeros(len(stretch.time))
        for segment in stretch.segments or (_whole(stretch),):
            part = slice(segment.start, segment.stop)
            local, phase[part] = _cycles_of(segment, piece, stretch.rate)
            numbers[part] = cycles + local
            count = int(local[-1]) + 1
            cycles += count
            owner += [len(conditions)] * count
            conditions.append(_condition(segment, piece))
        cycle.append(numbers)
        phases.append(phase)
    return Cycles(np.concatenate(cycle), np.concatenate(phases), np.array(owner), tuple(conditions))


def _whole(stretch: Stretch) -> Segment:
    """A stretch without segments, as one."""
    return Segment(0, stretch.name, 0, len(stretch.time), "table", None, None, None)


def _cycles_of(segment: Segment, piece: Piece, rate: float) -> tuple[npt.NDArray[np.intp], Array]:
    """Number of the cycle and phase of each sample of a segment; the rest at its end joins the last whole one."""
    count = segment.stop - segment.start
    if segment.motion not in _PERIODIC or not segment.frequency:
        last = max(int(count / rate / _BLOCK) - 1, 0)
        numbers = np.minimum((np.arange(count) / (_BLOCK * rate)).astype(int), last)
        return numbers, np.zeros(count)
    turns = np.arange(count) * segment.frequency / rate
    part = slice(segment.start, segment.stop)
    wave = np.exp(-2j * np.pi * turns)
    first = np.sum(piece.stroke.displacement[part] * wave)
    phase = (turns + (np.angle(first) / (2 * np.pi) + 0.25)) % 1.0
    whole = max(int(count * segment.frequency / rate + _NEARLY), 1)
    return np.minimum(turns.astype(int), whole - 1), phase


def _condition(segment: Segment, piece: Piece) -> Condition:
    part = slice(segment.start, segment.stop)
    periodic = segment.motion in _PERIODIC and segment.frequency
    amplitude = segment.amplitude or float(np.ptp(piece.stroke.displacement[part])) / 2.0
    drive = segment.drive_value
    return Condition(
        float(np.mean(piece.stroke.drive[part])) if drive is None else drive,
        amplitude,
        float(segment.frequency or 0.0) if periodic else 0.0,
    )
