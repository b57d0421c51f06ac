"""Finds the segments of a recording: where its motion or its drive changes.

Strokes that repeat are a sine; what does not repeat is a random motion where it goes on for long, and `other`
(a ramp, a transition) where it is short. A sine is followed outwards for as long as the motion keeps to it, so
two that meet are parted at the sample where one becomes the other. Each motion is then cut where the drive
changes, unless the drive changes so often that it is a programme of its own.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bench.recorder.plateau import NEGLIGIBLE, Plateau, edge, find_plateaus
from bench.recorder.stroke import (
    Stroke,
    find_holds,
    find_strokes,
    fit_sine,
    half_period,
    smallest_travel,
    steady_runs,
)

Array = npt.NDArray[np.float64]

_RANDOM = 8
"""Strokes at least that do not repeat before they are called random."""

_RANDOM_SPREAD = 0.2
"""[1] deviation of their amplitudes over the mean; the strokes of a sweep differ by less."""

_SINE_MISFIT = 0.06
"""[1] a triangle misses a sine of its own by twice as much."""

_SINE_SPREAD = 0.03
"""[1] spread of the strokes' durations in a sine, beside what noise adds."""

_KEEPS_TO = 0.04
"""[1] of the amplitude within which a motion still keeps to its sine."""

_CONSTANT = 0.4
"""Cycles at least of constant drive that make a segment."""

_CONSTANT_RANDOM = 1.0
"""[s] at least of constant drive that make a segment of a random motion."""

_MOSTLY = 0.7
"""Share of a motion that must be at constant drives for it to be cut there."""


@dataclass(frozen=True)
class FoundSegment:
    """One segment of a recording."""

    start: int
    """First sample."""
    stop: int
    """One beyond the last sample."""
    motion: str
    """sine, random, hold or other."""
    amplitude: float | None = None
    """[m] of a sine."""
    frequency: float | None = None
    """[Hz] of a sine."""
    drive_value: float | None = None
    """[V or A], none where the drive varies."""


@dataclass(frozen=True)
class _Motion:
    start: int
    stop: int
    kind: str
    half: float
    """Typical time of a stroke [samples]."""
    strokes: tuple[Stroke, ...] = ()


def find_segments(time: Array, displacement: Array, drive: Array, rate: float) -> list[FoundSegment]:
    """The segments of a recording, one after the other without gaps.

    Args:
        time: [s], increasing, shape (samples,).
        displacement: [m], shape (samples,), noise of some micrometres allowed.
        drive: [V or A], shape (samples,), commanded or measured.
        rate: [Hz].
    """
    if not len(time) == len(displacement) == len(drive):
        raise ValueError("time, displacement and drive differ in length")
    travel = smallest_travel(displacement)
    motions = _motions(displacement, travel, rate)
    plateaus, tolerance = find_plateaus(drive, rate)
    motions = _snapped(motions, [edge(drive, *pair) for pair in pairwise(plateaus)])
    return [
        _described(segment, motion, displacement, rate)
        for motion in motions
        for segment in _cut_by_drive(motion, plateaus, drive, tolerance, rate)
    ]


def segment_names(segments: Sequence[FoundSegment], drive_unit: str) -> list[str]:
    """A name for each: ``10mm_1Hz_0.2V``, ``hold_0V``, ``random``; one that repeats gets ``_2``, ``_3``.

    Args:
        segments: of one recording.
        drive_unit: V or A.
    """
    seen: Counter[str] = Counter()
    names = []
    for segment in segments:
        name = _name(segment, drive_unit)
        seen[name] += 1
        names.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return names


def _name(segment: FoundSegment, drive_unit: str) -> str:
    name = segment.motion
    if segment.amplitude is not None and segment.frequency is not None:
        name = f"{segment.amplitude * 1e3:.2g}mm_{_short(segment.frequency)}Hz"
    return name if segment.drive_value is None else f"{name}_{_short(segment.drive_value)}{drive_unit}"


def _short(value: float) -> str:
    """The number in the fewest digits, at most three, that keep it within half a percent."""
    if abs(value) < NEGLIGIBLE:
        return "0"
    texts = [f"{value:.{digits}g}" for digits in (1, 2, 3)]
    return next((text for text in texts if abs(float(text) - value) <= 0.005 * abs(value)), texts[-1])


def _motions(displacement: Array, travel: float, rate: float) -> list[_Motion]:
    """The motions, one after the other without gaps."""
    strokes = find_strokes(displacement, travel)
    holds = [_Motion(*hold, "hold", 0.25 * rate) for hold in find_holds(displacement, strokes, travel, rate)]
    motions = list(holds)
    for start, stop in _between(holds, len(displacement)):
        inside = [s for s in strokes if s.middle >= start and s.middle < stop]
        sines = _sines(displacement, inside, start, stop, travel)
        rests = [_unsteady(inside, *gap) for gap in _between(sines, stop, start)]
        motions += [*sines, *rests]
    return _without_slivers(sorted(motions, key=lambda motion: motion.start), rate)


def _between(motions: Sequence[_Motion], stop: int, start: int = 0) -> list[tuple[int, int]]:
    """The gaps that the motions leave between two samples."""
    edges = [start, *(at for motion in motions for at in (motion.start, motion.stop)), stop]
    return [(first, last) for first, last in zip(edges[::2], edges[1::2], strict=True) if last > first]


def _unsteady(strokes: Sequence[Stroke], start: int, stop: int) -> _Motion:
    """A motion between sines: random where it goes on for long in strokes of different amplitude."""
    inside = [s for s in strokes if start <= s.middle < stop]
    half = float(np.median([s.stop - s.start for s in inside])) if inside else float(stop - start)
    amplitudes = [s.amplitude for s in inside]
    varied = len(inside) >= _RANDOM and float(np.std(amplitudes)) > _RANDOM_SPREAD * float(np.mean(amplitudes))
    return _Motion(start, stop, "random" if varied else "other", half)


def _sines(displacement: Array, strokes: Sequence[Stroke], start: int, stop: int, travel: float) -> list[_Motion]:
    """Runs of strokes that repeat, each followed outwards; those that meet parted where they fit best."""
    found: list[_Motion] = []
    for run in steady_runs(strokes):
        half = half_period(run)
        misfit = fit_sine(displacement, half, slice(run[0].start, run[-1].stop), slice(0, 0)).misfit
        kind = "sine" if misfit < _SINE_MISFIT and _is_even(run, travel) else "other"
        first = _follow(displacement, run[:2], half, start, travel)
        last = _follow(displacement, run[-2:], half, stop, travel)
        motion = _Motion(first, last, kind, half, tuple(run))
        if found and found[-1].stop > motion.start:
            at = _parting(displacement, found[-1], motion)
            found[-1], motion = replace(found[-1], stop=at), replace(motion, start=at)
        found.append(motion)
    return found


def _is_even(run: Sequence[Stroke], travel: float) -> bool:
    """Whether a run stays one sine, where each stroke alone resembles the one before: a slow sweep does not."""
    amplitudes = [s.amplitude for s in run]
    paces = np.diff([s.middle for s in run])
    # Noise moves a crossing by its size over the slope there, which is 2 pi amplitudes a period.
    spread = _SINE_SPREAD + travel / (2 * np.pi * min(amplitudes))
    return max(amplitudes) < 1.5 * min(amplitudes) and float(np.max(paces) / np.min(paces)) < 1 + spread


def _follow(displacement: Array, run: Sequence[Stroke], half: float, limit: int, travel: float) -> int:
    """How far from a run towards a limit the motion keeps to the sine through it."""
    fitted = slice(run[0].start, run[-1].stop + 1)
    forward = limit >= fitted.stop
    wanted = slice(fitted.start, limit) if forward else slice(limit, fitted.stop)
    sine = fit_sine(displacement, half, fitted, wanted)
    strays = np.abs(displacement[wanted] - sine.curve) > max(travel, _KEEPS_TO * sine.amplitude)
    if forward:
        strays[: fitted.stop - fitted.start] = False
        return wanted.start + int(np.argmax(strays)) if strays.any() else limit
    strays[fitted.start - limit :] = False
    return wanted.start + len(strays) - int(np.argmax(strays[::-1])) if strays.any() else limit


def _parting(displacement: Array, left: _Motion, right: _Motion) -> int:
    """The sample from which the right one of two sines fits better than the left one."""
    first, last = left.strokes[-1].start, right.strokes[0].stop
    if last <= first:
        return left.stop
    wanted = slice(first, last)
    misses = [
        (displacement[wanted] - fit_sine(displacement, side.half, fitted, wanted).curve) ** 2
        for side, fitted in (
            (left, slice(left.strokes[-2].start, left.strokes[-1].stop)),
            (right, slice(right.strokes[0].start, right.strokes[1].stop)),
        )
    ]
    costs = np.append(0, np.cumsum(misses[0])) + np.append(np.cumsum(misses[1][::-1])[::-1], 0)
    return first + int(np.argmin(costs))


def _without_slivers(motions: Sequence[_Motion], rate: float) -> list[_Motion]:
    """The motions without those too short to be any, and neighbours that are no sine made one."""
    kept: list[_Motion] = []
    for motion in motions:
        # Some 20 ms between two motions are the seam of both.
        sliver = motion.stop - motion.start < max(3, 0.02 * rate)
        if kept and (sliver or _alike(kept[-1], motion)):
            longer = max(kept[-1], motion, key=lambda m: m.stop - m.start)
            kept[-1] = replace(longer, start=kept[-1].start, stop=motion.stop)
        elif kept or not sliver:
            kept.append(replace(motion, start=kept[-1].stop if kept else 0))
    return kept or list(motions)


def _alike(left: _Motion, right: _Motion) -> bool:
    return left.kind == right.kind == "hold" or {left.kind, right.kind} <= {"other", "random"}


def _snapped(motions: Sequence[_Motion], edges: Sequence[int]) -> list[_Motion]:
    """The motions, moved onto a change of drive where one stands very near their boundary."""
    snapped = list(motions)
    for i, (left, right) in enumerate(pairwise(motions)):
        # A turning point is known less sharply than a step of the drive: a tenth of a stroke is within doubt.
        near = 0.1 * min(left.half, right.half)
        close = [at for at in edges if abs(at - right.start) <= near]
        if close and left.start < close[0] < right.stop:
            snapped[i] = replace(snapped[i], stop=close[0])
            snapped[i + 1] = replace(snapped[i + 1], start=close[0])
    return snapped


def _cut_by_drive(
    motion: _Motion, plateaus: Sequence[Plateau], drive: Array, tolerance: float, rate: float
) -> list[FoundSegment]:
    """One motion, cut where its drive changes, or whole with no drive value where it varies."""
    whole = FoundSegment(motion.start, motion.stop, motion.kind)
    enough = _CONSTANT_RANDOM * rate if motion.kind == "random" else _CONSTANT * 2 * motion.half
    shortest = min(enough, 0.9 * (motion.stop - motion.start))
    inside = [plateau.within(motion.start, motion.stop) for plateau in plateaus]
    steady = [plateau for plateau in inside if len(plateau) and len(plateau) >= shortest]
    if sum(map(len, steady)) < _MOSTLY * (motion.stop - motion.start):
        return [whole]
    pieces = [replace(whole, drive_value=steady[0].level)]
    for left, right in pairwise(steady):
        gap = right.start - left.stop
        if gap < shortest and abs(right.level - left.level) <= tolerance:
            continue
        if gap < shortest:
            at = begins = edge(drive, left, right)
        else:
            at, begins = left.stop, right.start
        varying = [] if at == begins else [replace(whole, start=at, stop=begins)]
        pieces[-1:] = [replace(pieces[-1], stop=at), *varying]
        pieces.append(replace(whole, start=begins, drive_value=right.level))
    return pieces


def _described(segment: FoundSegment, motion: _Motion, displacement: Array, rate: float) -> FoundSegment:
    """The segment with amplitude and frequency, where it is a sine."""
    if motion.kind != "sine":
        return segment
    part = slice(segment.start, segment.stop)
    amplitude = fit_sine(displacement, motion.half, part, slice(0, 0)).amplitude
    return replace(segment, amplitude=amplitude, frequency=rate / (2 * motion.half))
