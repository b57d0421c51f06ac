"""Selection of strokes for a plot: one or two steady cycles per drive, so that it is readable."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.log import LoggedSegment
from bench.report.recording import Array, Recording

_STATIONARY_MOTIONS = ("hold", "other")
"""Motions that are not strokes: rests, and unclassified motions of an import."""
_MAX_RATIO = 1.2
"""Largest ratio of two amplitudes or frequencies that count as the same stroke at several drives."""
_MAX_CYCLES = 2
"""Largest number of cycles of a steady stroke in a plot over time."""
_CYCLE_TOLERANCE = 0.03
"""Largest missing share of a cycle that still counts as complete."""
_MAX_WINDOW, _MAX_CROSSINGS = 4.0, 20
"""Longest time [s], and largest number of passages through the mean, shown of a stroke without steady cycles."""


@dataclass(frozen=True)
class Trace:
    """Part of a recording at one drive."""

    drive: float | None
    """[V or A]; None if it varies."""
    rows: slice
    """Samples for plots over time."""
    loop: slice
    """Samples for plots over displacement and velocity: the last cycle, if there are cycles."""


@dataclass(frozen=True)
class Stroke:
    """One motion at one or several drives."""

    title: str
    traces: tuple[Trace, ...]

    @property
    def has_varying_drive(self) -> bool:
        """True if the drive varies within a trace."""
        return any(trace.drive is None for trace in self.traces)


def choose_strokes(recording: Recording, limit: int = 3) -> tuple[Stroke, ...]:
    """Choose the strokes to plot: those with many drives, from slow to fast.

    Args:
        recording: recording with its segments; without segments, a window in its middle is chosen.
        limit: largest number of strokes.
    """
    moving = [s for s in recording.segments if s.motion not in _STATIONARY_MOTIONS and s.stop - s.start > 50]
    groups = sorted(_group_segments(moving), key=lambda group: -len(_find_longest_segments(recording, group)))
    strokes = [_make_stroke(recording, group) for group in _select_groups(recording, groups, limit)]
    return tuple(strokes) or (_make_middle_stroke(recording),)


def _select_groups(
    recording: Recording, groups: list[list[LoggedSegment]], limit: int
) -> list[list[LoggedSegment]]:
    """Select the slowest, the fastest and some groups in between, of those with many drives."""
    rich = [
        g
        for g in groups
        if 2 * len(_find_longest_segments(recording, g)) >= len(_find_longest_segments(recording, groups[0]))
    ]
    if len(rich) <= limit:
        return groups[:limit]
    rich.sort(key=lambda group: float(np.ptp(recording.velocity[group[0].start : group[0].stop])))
    return [rich[round(index)] for index in np.linspace(0, len(rich) - 1, limit)]


def _group_segments(segments: Iterable[LoggedSegment]) -> list[list[LoggedSegment]]:
    """Group segments with the same motion; those with a varying drive are separate."""
    groups: list[list[LoggedSegment]] = []
    for segment in segments:
        matching = next((group for group in groups if _is_same_stroke(group[0], segment)), None)
        if matching is None:
            groups.append([segment])
        else:
            matching.append(segment)
    return groups


def _is_same_stroke(first: LoggedSegment, second: LoggedSegment) -> bool:
    same_kind = first.motion == second.motion and (first.drive_value is None) == (second.drive_value is None)
    same_amplitude = _is_close(first.amplitude, second.amplitude)
    return same_kind and same_amplitude and _is_close(first.frequency, second.frequency)


def _is_close(first: float | None, second: float | None) -> bool:
    if not first or not second:
        return first == second
    return max(first, second) / min(first, second) <= _MAX_RATIO


def _find_longest_segments(
    recording: Recording, group: Sequence[LoggedSegment]
) -> dict[float | None, LoggedSegment]:
    """Return the longest segment at each drive."""
    span = float(np.ptp(recording.drive))
    quantum = 10.0 ** math.floor(math.log10(span / 50)) if span > 0 else 1e-6
    longest: dict[float | None, LoggedSegment] = {}
    for segment in sorted(group, key=lambda s: s.stop - s.start):
        value = segment.drive_value
        longest[None if value is None else round(round(value / quantum) * quantum + 0.0, 9)] = segment
    return longest


def _make_stroke(recording: Recording, group: Sequence[LoggedSegment]) -> Stroke:
    by_drive = sorted(
        _find_longest_segments(recording, group).items(), key=lambda item: (item[0] is None, item[0] or 0.0)
    )
    traces = tuple(_make_trace(recording, drive, segment) for drive, segment in by_drive)
    return Stroke(_make_title(group[0]), traces)


def _make_title(segment: LoggedSegment) -> str:
    parts = [segment.motion]
    if segment.amplitude is not None:
        parts.append(f"{1e3 * segment.amplitude:.3g} mm")
    if segment.frequency is not None:
        parts.append(f"{segment.frequency:.3g} Hz")
    return ", ".join(parts) + (f", drive {segment.drive}" if segment.drive_value is None else "")


def _make_trace(recording: Recording, drive: float | None, segment: LoggedSegment) -> Trace:
    duration = (segment.stop - segment.start - 1) * _find_time_step(recording)
    if drive is None or not segment.frequency or duration * segment.frequency < 1.0 + _CYCLE_TOLERANCE:
        rows = _find_window(recording, segment.start, segment.stop)
        return Trace(drive, rows, rows)
    return _find_last_cycles(recording, drive, segment, segment.frequency)


def _find_last_cycles(recording: Recording, drive: float, segment: LoggedSegment, frequency: float) -> Trace:
    """Return the last complete cycles of a segment, from a rise of the displacement through its mean."""
    time = recording.time[segment.start : segment.stop] - recording.time[segment.start]
    displacement = recording.displacement[segment.start : segment.stop]
    rise = _find_first_rise(time, displacement, frequency)
    complete = max(1, math.floor(frequency * (float(time[-1]) - rise) + _CYCLE_TOLERANCE))
    cycles = min(_MAX_CYCLES, complete)
    first, end = (
        segment.start + int(np.searchsorted(time, rise + n / frequency)) for n in (complete - cycles, complete)
    )
    period = int(np.searchsorted(time, 1 / frequency)) + 1
    return Trace(
        drive,
        slice(first, min(end + 1, segment.stop)),
        slice(max(segment.start, segment.stop - period), segment.stop),
    )


def _find_time_step(recording: Recording) -> float:
    """Return the median time between samples [s]."""
    return float(np.median(np.diff(recording.time)))


def _find_first_rise(time: Array, displacement: Array, frequency: float) -> float:
    """Return the time [s] of a periodic motion's first rise through its mean, possibly just before its start."""
    # Computed from the phase, because with noise the motion passes its mean several times at each rise.
    wave = np.sum((displacement - displacement.mean()) * np.exp(-2j * math.pi * frequency * time))
    turns = (-0.25 - float(np.angle(wave)) / (2 * math.pi)) % 1.0
    return (turns - 1.0 if turns > 1.0 - _CYCLE_TOLERANCE else turns) / frequency


def _make_middle_stroke(recording: Recording) -> Stroke:
    rows = _find_window(recording, 0, len(recording.time))
    return Stroke("middle of the recording", (Trace(None, rows, rows),))


def _find_window(recording: Recording, start: int, stop: int) -> slice:
    """Return the middle of a part of a recording: some seconds, or less if the motion is fast."""
    time: Array = recording.time[start:stop]
    displacement = recording.displacement[start:stop]
    crossings = int(np.count_nonzero(np.diff(np.signbit(displacement - displacement.mean()))))
    length = min(_MAX_WINDOW, float(np.ptp(time)) * _MAX_CROSSINGS / max(crossings, 1))
    middle = 0.5 * float(time[0] + time[-1])
    first, last = np.searchsorted(time, [middle - length / 2, middle + length / 2])
    return slice(start + int(first), start + int(last))
