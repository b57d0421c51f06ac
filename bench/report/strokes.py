"""Which strokes of a recording a picture shows: one or two steady cycles a drive, so that it stays readable."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.recorder.reader import LoggedSegment
from bench.report.recording import Array, Recording

_STILL = ("hold", "other")
"""Motions of no stroke: rests, and what an import could not name."""
_ALIKE = 1.2
"""[1] ratio of two amplitudes or frequencies up to which they are one stroke at several drives."""
_CYCLES = 2
"""Shown of a steady stroke over time, at most."""
_SLACK = 0.03
"""[1] part of a cycle that may be missing from a whole one."""
_WINDOW, _CROSSINGS = 4.0, 20
"""[s] at most, and times that the motion passes its mean, shown of a stroke without steady cycles."""


@dataclass(frozen=True)
class Trace:
    """Part of a recording at one drive."""

    drive: float | None
    """[V or A] none where it varies."""
    rows: slice
    """Samples drawn over time."""
    loop: slice
    """Samples drawn over displacement and velocity: the last cycle where there are cycles."""


@dataclass(frozen=True)
class Stroke:
    """One motion, at one or several drives."""

    title: str
    traces: tuple[Trace, ...]

    @property
    def varying(self) -> bool:
        """Whether its drive varies within a trace."""
        return any(trace.drive is None for trace in self.traces)


def choose_strokes(recording: Recording, most: int = 3) -> tuple[Stroke, ...]:
    """The strokes to draw: with many drives, from slow to fast.

    Args:
        recording: with its segments; without any, a window in its middle stands for it.
        most: how many strokes at most.
    """
    moving = [s for s in recording.segments if s.motion not in _STILL and s.stop - s.start > 50]
    groups = sorted(_grouped(moving), key=lambda group: -len(_by_level(recording, group)))
    strokes = [_stroke(recording, group) for group in _spread(recording, groups, most)]
    return tuple(strokes) or (_middle(recording),)


def _spread(recording: Recording, groups: list[list[LoggedSegment]], most: int) -> list[list[LoggedSegment]]:
    """Of the groups with many drives, the slowest, the fastest and some between."""
    rich = [g for g in groups if 2 * len(_by_level(recording, g)) >= len(_by_level(recording, groups[0]))]
    if len(rich) <= most:
        return groups[:most]
    rich.sort(key=lambda group: float(np.ptp(recording.velocity[group[0].start : group[0].stop])))
    return [rich[round(place)] for place in np.linspace(0, len(rich) - 1, most)]


def _grouped(segments: Iterable[LoggedSegment]) -> list[list[LoggedSegment]]:
    """Segments of one motion together, those with a varying drive apart."""
    groups: list[list[LoggedSegment]] = []
    for segment in segments:
        found = next((group for group in groups if _same_stroke(group[0], segment)), None)
        if found is None:
            groups.append([segment])
        else:
            found.append(segment)
    return groups


def _same_stroke(one: LoggedSegment, other: LoggedSegment) -> bool:
    same_kind = one.motion == other.motion and (one.drive_value is None) == (other.drive_value is None)
    return same_kind and _close(one.amplitude, other.amplitude) and _close(one.frequency, other.frequency)


def _close(one: float | None, other: float | None) -> bool:
    if not one or not other:
        return one == other
    return max(one, other) / min(one, other) <= _ALIKE


def _by_level(recording: Recording, group: Sequence[LoggedSegment]) -> dict[float | None, LoggedSegment]:
    """The longest segment at each drive."""
    span = float(np.ptp(recording.drive))
    quantum = 10.0 ** math.floor(math.log10(span / 50)) if span > 0 else 1e-6
    longest: dict[float | None, LoggedSegment] = {}
    for segment in sorted(group, key=lambda s: s.stop - s.start):
        value = segment.drive_value
        longest[None if value is None else round(round(value / quantum) * quantum + 0.0, 9)] = segment
    return longest


def _stroke(recording: Recording, group: Sequence[LoggedSegment]) -> Stroke:
    found = sorted(_by_level(recording, group).items(), key=lambda item: (item[0] is None, item[0] or 0.0))
    return Stroke(_title(group[0]), tuple(_trace(recording, drive, segment) for drive, segment in found))


def _title(segment: LoggedSegment) -> str:
    words = [segment.motion]
    if segment.amplitude is not None:
        words.append(f"{1e3 * segment.amplitude:.3g} mm")
    if segment.frequency is not None:
        words.append(f"{segment.frequency:.3g} Hz")
    return ", ".join(words) + (f", drive {segment.drive}" if segment.drive_value is None else "")


def _trace(recording: Recording, drive: float | None, segment: LoggedSegment) -> Trace:
    lasts = (segment.stop - segment.start - 1) * _step(recording)
    if drive is None or not segment.frequency or lasts * segment.frequency < 1.0 + _SLACK:
        rows = _window(recording, segment.start, segment.stop)
        return Trace(drive, rows, rows)
    return _cycles(recording, drive, segment, segment.frequency)


def _cycles(recording: Recording, drive: float, segment: LoggedSegment, frequency: float) -> Trace:
    """The last whole cycles of a segment, from where its displacement rises through its mean."""
    time = recording.time[segment.start : segment.stop] - recording.time[segment.start]
    swing = recording.displacement[segment.start : segment.stop]
    rises = _first_rise(time, swing, frequency)
    whole = max(1, math.floor(frequency * (float(time[-1]) - rises) + _SLACK))
    cycles = min(_CYCLES, whole)
    first, end = (
        segment.start + int(np.searchsorted(time, rises + n / frequency)) for n in (whole - cycles, whole)
    )
    period = int(np.searchsorted(time, 1 / frequency)) + 1
    return Trace(
        drive,
        slice(first, min(end + 1, segment.stop)),
        slice(max(segment.start, segment.stop - period), segment.stop),
    )


def _step(recording: Recording) -> float:
    """Usual time between samples [s]."""
    return float(np.median(np.diff(recording.time)))


def _first_rise(time: Array, swing: Array, frequency: float) -> float:
    """When [s] a periodic motion first rises through its mean; may lie a little before its first sample."""
    # By the phase of the whole swing: with noise on it, it passes its mean several times at each rise.
    wave = np.sum((swing - swing.mean()) * np.exp(-2j * math.pi * frequency * time))
    turns = (-0.25 - float(np.angle(wave)) / (2 * math.pi)) % 1.0
    return (turns - 1.0 if turns > 1.0 - _SLACK else turns) / frequency


def _middle(recording: Recording) -> Stroke:
    rows = _window(recording, 0, len(recording.time))
    return Stroke("middle of the recording", (Trace(None, rows, rows),))


def _window(recording: Recording, start: int, stop: int) -> slice:
    """The middle of a part of a recording: some seconds, or fewer where the motion is swift."""
    time: Array = recording.time[start:stop]
    swing = recording.displacement[start:stop]
    crossings = int(np.count_nonzero(np.diff(np.signbit(swing - swing.mean()))))
    length = min(_WINDOW, float(np.ptp(time)) * _CROSSINGS / max(crossings, 1))
    middle = 0.5 * float(time[0] + time[-1])
    first, last = np.searchsorted(time, [middle - length / 2, middle + length / 2])
    return slice(start + int(first), start + int(last))
