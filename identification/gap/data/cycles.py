"""Cycles of a recording: one period of the stroke within one segment.

A cycle is the unit of holding out and of resampling. It is held out or fitted whole, because the errors of
neighbouring samples within a cycle are not independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.fitting import Piece, measure_scales
from identification.logs import PERIODIC_MOTIONS, Segment, Stretch

Number = TypeVar("Number", bound=np.generic)
Indices = npt.NDArray[np.intp]

_CYCLE_TOLERANCE = 0.1
"""Part of a cycle that may be missing at the end of a segment for the last cycle to count as whole."""
_HOLD_OUT_STRIDE = 4
"""Every so many strokes, or cycles, one is held out."""
_FEWEST_STROKES = 10
"""Threshold on the number of strokes: below it, cycles are held out instead of whole strokes."""


def split_by_piece(values: npt.NDArray[Number], pieces: Sequence[Piece]) -> list[npt.NDArray[Number]]:
    """Split values (N,) of all pieces in sequence into one array for each piece."""
    edges = np.cumsum([len(p.force) for p in pieces])[:-1]
    return np.split(values, edges)


@dataclass(frozen=True)
class StrokeCondition:
    """Drive, amplitude and frequency of one segment."""

    drive: float
    """Drive [V or A]."""
    amplitude: float
    """Amplitude [m]."""
    frequency: float
    """Frequency [Hz]; 0 where the motion is not periodic."""
    is_stroke: bool = True
    """False for a rest and for a motion that does not return, such as the way to another position."""


@dataclass(frozen=True)
class Cycles:
    """The cycles of all stretches; N counts the samples of all stretches in sequence."""

    cycle: Indices
    """(N,) number of each sample's cycle; -1 outside all cycles."""
    phase: Array
    """(N,) phase of the stroke [cycles]: 0 in the middle in extension, 0.25 at the extended end."""
    segment: Indices
    """(cycles,) number of each cycle's segment."""
    conditions: tuple[StrokeCondition, ...]
    """(segments,) condition of each segment."""

    @property
    def count(self) -> int:
        """Number of cycles."""
        return len(self.segment)

    @property
    def stroke_count(self) -> int:
        """Number of strokes of different amplitude or frequency."""
        return len({(f"{c.amplitude:.2g}", f"{c.frequency:.2g}") for c in self.conditions if c.frequency})

    def sum_by_cycle(self, values: Array, mask: BoolArray) -> Array:
        """Sum values (N,) over the samples of each cycle that the mask (N,) selects; (cycles,)."""
        chosen = mask & (self.cycle >= 0)
        return np.bincount(self.cycle[chosen], values[chosen], self.count).astype(float)


def cut_cycles(stretches: Sequence[Stretch], pieces: Sequence[Piece]) -> Cycles:
    """Cut stretches into cycles.

    Args:
        stretches: recorded stretches, with the segments of their method as far as they are known.
        pieces: the same stretches with their smoothed motion.
    """
    cycles: list[Indices] = []
    phases: list[Array] = []
    segments: list[int] = []
    conditions: list[StrokeCondition] = []
    total = 0
    usual = measure_scales(pieces).cycle_duration
    for stretch, piece in zip(stretches, pieces, strict=True):
        numbers, phase = np.full(len(stretch.time), -1), np.zeros(len(stretch.time))
        for segment in stretch.segments or (_make_whole_segment(stretch),):
            part = slice(segment.start, segment.stop)
            local, phase[part] = _number_cycles(segment, piece, stretch.rate, usual)
            numbers[part] = total + local
            count = int(local[-1]) + 1
            total += count
            segments += [len(conditions)] * count
            conditions.append(_find_condition(segment, piece))
        cycles.append(numbers)
        phases.append(phase)
    return Cycles(np.concatenate(cycles), np.concatenate(phases), np.array(segments), tuple(conditions))


def _make_whole_segment(stretch: Stretch) -> Segment:
    """Return one segment that covers a stretch without segments."""
    return Segment(0, stretch.name, 0, len(stretch.time), "table", None, None, None)


def _number_cycles(segment: Segment, piece: Piece, rate: float, usual: float) -> tuple[Indices, Array]:
    """Return cycle number and phase of each sample; a part of a cycle at the end joins the last whole one.

    Args:
        segment: part of the piece.
        piece: motion and force.
        rate: sampling rate [Hz].
        usual: length of a cycle [s] where the motion does not repeat.
    """
    count = segment.stop - segment.start
    if segment.motion not in PERIODIC_MOTIONS or not segment.frequency:
        last = max(int(count / rate / usual) - 1, 0)
        numbers = np.minimum((np.arange(count) / (usual * rate)).astype(int), last)
        return numbers, np.zeros(count)
    turns = np.arange(count) * segment.frequency / rate
    part = slice(segment.start, segment.stop)
    wave = np.exp(-2j * np.pi * turns)
    # A segment may begin anywhere in its stroke, so the phase comes from the motion itself.
    first = np.sum(piece.excitation.displacement[part] * wave)
    phase = (turns + (np.angle(first) / (2 * np.pi) + 0.25)) % 1.0
    whole = max(int(count * segment.frequency / rate + _CYCLE_TOLERANCE), 1)
    return np.minimum(turns.astype(int), whole - 1), phase


def _find_condition(segment: Segment, piece: Piece) -> StrokeCondition:
    displacement = piece.excitation.displacement[segment.start : segment.stop]
    periodic = segment.motion in PERIODIC_MOTIONS and segment.frequency
    drive = segment.drive_value
    return StrokeCondition(
        float(np.mean(piece.excitation.drive[segment.start : segment.stop])) if drive is None else drive,
        segment.amplitude or float(np.ptp(displacement)) / 2.0,
        float(segment.frequency or 0.0) if periodic else 0.0,
        bool(periodic) or _is_stroke(segment.motion, displacement),
    )


def _is_stroke(motion: str, displacement: Array) -> bool:
    """Return whether a motion that does not repeat goes forth and back at least once."""
    path, extent = np.sum(np.abs(np.diff(displacement))), np.ptp(displacement)
    return motion != "hold" and bool(path >= (1.0 - _CYCLE_TOLERANCE) * 2.0 * extent > 0.0)


def _select_held_out_strokes(cycles: Cycles, strokes: Sequence[int]) -> tuple[list[int], list[int]]:
    """Select every fourth stroke of each drive to be held out whole.

    Returns:
        The selected segments, and those that are the only stroke of their drive.
    """
    by_drive: dict[str, list[int]] = {}
    for stroke in strokes:
        by_drive.setdefault(f"{cycles.conditions[stroke].drive:.3g}", []).append(stroke)
    repeated = [by_drive[drive] for drive in sorted(by_drive, key=float) if len(by_drive[drive]) > 1]
    whole = [
        stroke
        for offset, members in enumerate(repeated)
        for stroke in members[(_HOLD_OUT_STRIDE // 2 - offset) % _HOLD_OUT_STRIDE :: _HOLD_OUT_STRIDE]
    ]
    return whole, [members[0] for members in by_drive.values() if len(members) == 1]


def select_held_out_cycles(cycles: Cycles, usable: BoolArray | None = None) -> BoolArray:
    """Select the held-out cycles, (cycles,): every fourth stroke of each drive, or every fourth cycle of strokes.

    Only ``usable`` cycles (cycles,) are counted and held out; None for all.

    A held-out stroke is a condition that no fit has used. Cycles are held out instead where strokes are few, and
    in the only stroke of a drive: no fit could know the damper at a drive that it has not met. Rests and motions
    that do not return are always fitted; they count as strokes in a recording that has nothing else.

    The strokes of each drive start at another offset: a method that repeats its drives would otherwise hold out
    one drive and fit the others. The cycles of each stroke start at another offset too, so that some held-out
    cycle follows a step of the drive.
    """
    usable = np.ones(cycles.count, bool) if usable is None else usable
    segments = [int(s) for s in np.unique(cycles.segment[usable])]
    strokes = [s for s in segments if cycles.conditions[s].is_stroke] or segments
    whole, divided = ([], strokes) if len(strokes) < _FEWEST_STROKES else _select_held_out_strokes(cycles, strokes)
    held_out = np.asarray(usable & np.isin(cycles.segment, whole))
    for offset, segment in enumerate(divided, _HOLD_OUT_STRIDE // 2):
        members = np.flatnonzero(usable & (cycles.segment == segment))
        held_out[members[offset % _HOLD_OUT_STRIDE :: _HOLD_OUT_STRIDE]] = True
    if not held_out.any():
        held_out[np.flatnonzero(usable)[1::_HOLD_OUT_STRIDE]] = True
    return held_out
