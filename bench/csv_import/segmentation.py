"""Segmentation of a recording at changes of its motion and of its drive.

Half cycles that repeat form a sine. Other motions are `random` if they are long, and `other` (a ramp, a
transition) if they are short. A sine is extended outwards while the motion agrees with it; two sines that meet are
divided where the second fits better. Each motion is then divided at changes of the drive, unless the drive varies
all the time.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bench.csv_import.half_cycles import (
    HalfCycle,
    estimate_half_period,
    estimate_min_travel,
    find_half_cycles,
    find_holds,
    find_steady_groups,
    fit_sine,
)
from bench.csv_import.plateaus import NEGLIGIBLE_STEP, Plateau, find_edge, find_plateaus

Array = npt.NDArray[np.float64]

_MIN_RANDOM_COUNT = 8
"""Smallest number of half cycles without repetition that count as random."""

_MIN_RANDOM_SPREAD = 0.2
"""Smallest relative deviation of the amplitudes of a random motion; that of a sweep is smaller."""

_MIN_SINE_CYCLES = 1.9
"""Shortest sine [cycles]: two cycles, of which noise may hide the ends."""

_MAX_SINE_MISFIT = 0.06
"""Largest misfit of a sine over its amplitude; that of a triangle is twice as large."""

_MAX_SINE_SPREAD = 0.03
"""Largest relative spread of the durations of half cycles in a sine, in addition to that from noise."""

_SINE_TOLERANCE = 0.04
"""Largest deviation of a motion from its sine, over the amplitude."""

_MIN_CONSTANT_CYCLES = 0.4
"""Shortest plateau [cycles] that becomes a segment."""

_MIN_CONSTANT_TIME = 1.0
"""Shortest plateau [s] that becomes a segment of a random motion."""

_MIN_CONSTANT_SHARE = 0.7
"""Smallest share of plateaus in a motion that is divided at them."""


@dataclass(frozen=True)
class DetectedSegment:
    """One segment of a recording."""

    start: int
    """First sample."""
    stop: int
    """One after the last sample."""
    motion: str
    """sine, random, hold or other."""
    amplitude: float | None = None
    """Amplitude of a sine [m]."""
    frequency: float | None = None
    """Frequency of a sine [Hz]."""
    drive_value: float | None = None
    """[V or A]; None if the drive varies."""


@dataclass(frozen=True)
class _Motion:
    start: int
    stop: int
    kind: str
    half_period: float
    """Typical duration of a half cycle [samples]."""
    half_cycles: tuple[HalfCycle, ...] = ()


def find_segments(time: Array, displacement: Array, drive: Array, rate: float) -> list[DetectedSegment]:
    """Find the segments of a recording, in order and without gaps.

    Args:
        time: [s], increasing, shape (samples,).
        displacement: [m], shape (samples,), with noise of up to some micrometres.
        drive: [V or A], shape (samples,), commanded or measured.
        rate: sampling rate [Hz].
    """
    if not len(time) == len(displacement) == len(drive):
        raise ValueError("time, displacement and drive differ in length")
    travel = estimate_min_travel(displacement)
    motions = _find_motions(displacement, travel, rate)
    plateaus, tolerance = find_plateaus(drive, rate)
    motions = _snap_to_drive(motions, [find_edge(drive, *pair) for pair in pairwise(plateaus)])
    return [
        _add_sine_parameters(segment, motion, displacement, rate)
        for motion in motions
        for segment in _split_by_drive(motion, plateaus, drive, tolerance, rate)
    ]


def make_segment_names(segments: Sequence[DetectedSegment], drive_unit: str) -> list[str]:
    """Return the names of segments: ``10mm_1Hz_0.2V``, ``hold_0V``, ``random``; repeated ones get ``_2``, ``_3``.

    Args:
        segments: segments of one recording.
        drive_unit: V or A.
    """
    counts: Counter[str] = Counter()
    names = []
    for segment in segments:
        name = _make_name(segment, drive_unit)
        counts[name] += 1
        names.append(name if counts[name] == 1 else f"{name}_{counts[name]}")
    return names


def _make_name(segment: DetectedSegment, drive_unit: str) -> str:
    name = segment.motion
    if segment.amplitude is not None and segment.frequency is not None:
        name = f"{segment.amplitude * 1e3:.2g}mm_{_format_short(segment.frequency)}Hz"
    return name if segment.drive_value is None else f"{name}_{_format_short(segment.drive_value)}{drive_unit}"


def _format_short(value: float) -> str:
    """Format a number with the fewest digits, at most three, that keep it within half a percent."""
    if abs(value) < NEGLIGIBLE_STEP:
        return "0"
    texts = [f"{value:.{digits}g}" for digits in (1, 2, 3)]
    return next((text for text in texts if abs(float(text) - value) <= 0.005 * abs(value)), texts[-1])


def _find_motions(displacement: Array, travel: float, rate: float) -> list[_Motion]:
    """Find the motions, in order and without gaps."""
    half_cycles = find_half_cycles(displacement, travel)
    holds = [_Motion(*hold, "hold", 0.25 * rate) for hold in find_holds(displacement, half_cycles, travel, rate)]
    motions = list(holds)
    for start, stop in _find_gaps(holds, len(displacement)):
        inside = [cycle for cycle in half_cycles if cycle.middle >= start and cycle.middle < stop]
        sines = _find_sines(displacement, inside, start, stop, travel)
        unsteady = [_make_unsteady_motion(inside, *gap) for gap in _find_gaps(sines, stop, start)]
        motions += [*sines, *unsteady]
    return _merge_slivers(sorted(motions, key=lambda motion: motion.start), rate)


def _find_gaps(motions: Sequence[_Motion], stop: int, start: int = 0) -> list[tuple[int, int]]:
    """Return the gaps between motions within two samples."""
    edges = [start, *(edge for motion in motions for edge in (motion.start, motion.stop)), stop]
    return [(first, last) for first, last in zip(edges[::2], edges[1::2], strict=True) if last > first]


def _make_unsteady_motion(half_cycles: Sequence[HalfCycle], start: int, stop: int) -> _Motion:
    """Make a motion between sines: random if it has many half cycles of different amplitude."""
    inside = [cycle for cycle in half_cycles if start <= cycle.middle < stop]
    durations = [cycle.stop - cycle.start for cycle in inside] or [stop - start]
    amplitudes = np.array([cycle.amplitude for cycle in inside])
    is_random = len(inside) >= _MIN_RANDOM_COUNT and amplitudes.std() > _MIN_RANDOM_SPREAD * amplitudes.mean()
    return _Motion(start, stop, "random" if is_random else "other", float(np.median(durations)))


def _find_sines(
    displacement: Array, half_cycles: Sequence[HalfCycle], start: int, stop: int, travel: float
) -> list[_Motion]:
    """Find groups of repeating half cycles, extend them outwards, and divide those that meet."""
    motions: list[_Motion] = []
    for group in find_steady_groups(half_cycles):
        half_period = estimate_half_period(group)
        misfit = fit_sine(displacement, half_period, slice(group[0].start, group[-1].stop), slice(0, 0)).misfit
        kind = "sine" if misfit < _MAX_SINE_MISFIT and _is_single_sine(group, travel) else "other"
        first = _extend_sine(displacement, group[:2], half_period, start, travel)
        last = _extend_sine(displacement, group[-2:], half_period, stop, travel)
        if last - first < _MIN_SINE_CYCLES * 2 * half_period:
            continue
        motion = _Motion(first, last, kind, half_period, tuple(group))
        if motions and motions[-1].stop > motion.start:
            boundary = _find_boundary(displacement, motions[-1], motion)
            motions[-1], motion = replace(motions[-1], stop=boundary), replace(motion, start=boundary)
        motions.append(motion)
    return motions


def _is_single_sine(group: Sequence[HalfCycle], travel: float) -> bool:
    """Return whether a group is one sine as a whole; in a slow sweep only successive half cycles are alike."""
    amplitudes = [cycle.amplitude for cycle in group]
    half_periods = np.diff([cycle.middle for cycle in group])
    # Noise shifts a crossing by its size over the slope there, which is 2 pi amplitudes per period.
    spread = _MAX_SINE_SPREAD + travel / (2 * np.pi * min(amplitudes))
    ratio = float(np.max(half_periods) / np.min(half_periods))
    return max(amplitudes) < 1.5 * min(amplitudes) and ratio < 1 + spread


def _extend_sine(
    displacement: Array, group: Sequence[HalfCycle], half_period: float, limit: int, travel: float
) -> int:
    """Return the sample up to which, from a group towards a limit, the motion agrees with the group's sine."""
    fitted = slice(group[0].start, group[-1].stop + 1)
    forward = limit >= fitted.stop
    part = slice(fitted.start, limit) if forward else slice(limit, fitted.stop)
    sine = fit_sine(displacement, half_period, fitted, part)
    deviates = np.abs(displacement[part] - sine.curve) > max(travel, _SINE_TOLERANCE * sine.amplitude)
    if forward:
        deviates[: fitted.stop - fitted.start] = False
        return part.start + int(np.argmax(deviates)) if deviates.any() else limit
    deviates[fitted.start - limit :] = False
    return part.start + len(deviates) - int(np.argmax(deviates[::-1])) if deviates.any() else limit


def _find_boundary(displacement: Array, left: _Motion, right: _Motion) -> int:
    """Return the sample from which the right one of two sines fits better than the left one."""
    first, last = left.half_cycles[-1].start, right.half_cycles[0].stop
    if last <= first:
        return left.stop
    part = slice(first, last)
    errors = [
        (displacement[part] - fit_sine(displacement, side.half_period, fitted, part).curve) ** 2
        for side, fitted in (
            (left, slice(left.half_cycles[-2].start, left.half_cycles[-1].stop)),
            (right, slice(right.half_cycles[0].start, right.half_cycles[1].stop)),
        )
    ]
    costs = np.append(0, np.cumsum(errors[0])) + np.append(np.cumsum(errors[1][::-1])[::-1], 0)
    return first + int(np.argmin(costs))


def _merge_slivers(motions: Sequence[_Motion], rate: float) -> list[_Motion]:
    """Merge very short motions into their neighbours, and neighbours that are not sines into one."""
    merged: list[_Motion] = []
    for motion in motions:
        # Up to 20 ms between two motions belong to their transition.
        is_sliver = motion.stop - motion.start < max(3, 0.02 * rate)
        if merged and (is_sliver or _is_mergeable(merged[-1], motion)):
            longer = max(merged[-1], motion, key=lambda m: m.stop - m.start)
            merged[-1] = replace(longer, start=merged[-1].start, stop=motion.stop)
        elif merged or not is_sliver:
            merged.append(replace(motion, start=merged[-1].stop if merged else 0))
    return merged or list(motions)


def _is_mergeable(left: _Motion, right: _Motion) -> bool:
    return left.kind == right.kind == "hold" or {left.kind, right.kind} <= {"other", "random"}


def _snap_to_drive(motions: Sequence[_Motion], edges: Sequence[int]) -> list[_Motion]:
    """Move the boundaries of motions to a change of drive very near to them."""
    snapped = list(motions)
    for i, (left, right) in enumerate(pairwise(motions)):
        # A turning point is known less precisely than a step of the drive: to a tenth of a half cycle.
        tolerance = 0.1 * min(left.half_period, right.half_period)
        # The left motion may start later than before; a boundary at or before its start would empty it.
        near = [e for e in edges if abs(e - right.start) <= tolerance and snapped[i].start < e < right.stop]
        if near:
            snapped[i] = replace(snapped[i], stop=near[0])
            snapped[i + 1] = replace(snapped[i + 1], start=near[0])
    return snapped


def _split_by_drive(
    motion: _Motion, plateaus: Sequence[Plateau], drive: Array, tolerance: float, rate: float
) -> list[DetectedSegment]:
    """Divide a motion at changes of its drive, or keep it as one segment if the drive varies all the time."""
    undivided = DetectedSegment(motion.start, motion.stop, motion.kind)
    enough = (
        _MIN_CONSTANT_TIME * rate if motion.kind == "random" else _MIN_CONSTANT_CYCLES * 2 * motion.half_period
    )
    shortest = min(enough, 0.9 * (motion.stop - motion.start))
    inside = [plateau.clip(motion.start, motion.stop) for plateau in plateaus]
    steady = [plateau for plateau in inside if len(plateau) and len(plateau) >= shortest]
    if sum(map(len, steady)) < _MIN_CONSTANT_SHARE * (motion.stop - motion.start):
        return [undivided]
    segments = [replace(undivided, drive_value=steady[0].level)]
    for left, right in pairwise(steady):
        gap = right.start - left.stop
        if gap < shortest and abs(right.level - left.level) <= tolerance:
            continue
        if gap < shortest:
            stop = start = find_edge(drive, left, right)
        else:
            stop, start = left.stop, right.start
        varying = [] if stop == start else [replace(undivided, start=stop, stop=start)]
        segments[-1:] = [replace(segments[-1], stop=stop), *varying]
        segments.append(replace(undivided, start=start, drive_value=right.level))
    # A change of drive at the motion's own boundary makes an empty segment.
    return [segment for segment in segments if segment.stop > segment.start]


def _add_sine_parameters(
    segment: DetectedSegment, motion: _Motion, displacement: Array, rate: float
) -> DetectedSegment:
    """Add amplitude and frequency to a segment of a sine."""
    if motion.kind != "sine":
        return segment
    part = slice(segment.start, segment.stop)
    amplitude = fit_sine(displacement, motion.half_period, part, slice(0, 0)).amplitude
    return replace(segment, amplitude=amplitude, frequency=rate / (2 * motion.half_period))
