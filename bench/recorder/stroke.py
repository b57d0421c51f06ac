"""Takes a recorded motion apart into strokes, and finds where they repeat as a sine.

A stroke is the travel between two turning points. Its amplitude is half its travel; its time is where it
crosses its own middle, which noise hardly moves, while it moves a turning point a good deal.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d, minimum_filter1d

Array = npt.NDArray[np.float64]

SMALLEST_TRAVEL = 20e-6
"""[m] travel below which a motion is rest or noise."""

_STILL = 0.25
"""[s] at least of rest that makes a hold."""

_STEADY = 4
"""Strokes at least that repeat before they are called a sine: two cycles."""

_SAME_SIZE, _SAME_PACE = 0.05, 0.04
"""[1] by which amplitude and time of a stroke may differ from those before, and still repeat them."""

_MUCH = 0.4
"""[1] of the strokes that it touches for which a rest must last."""


@dataclass(frozen=True)
class Stroke:
    """The travel between two turning points."""

    start: int
    """Sample of the turning point where it starts."""
    stop: int
    """Sample of the turning point where it ends."""
    amplitude: float
    """[m] half its travel."""
    middle: float
    """[sample] where it crosses its middle."""


@dataclass(frozen=True)
class SineFit:
    """A sine through some samples."""

    amplitude: float
    """[m]"""
    misfit: float
    """[1] rms of what is left, over the amplitude."""
    curve: Array
    """The sine at the samples asked for [m]."""


def smallest_travel(displacement: Array) -> float:
    """Travel that stands above the noise [m]: eight deviations, 0.3 % of the range, at least 20 µm."""
    # Motion hardly shows in second differences; white noise has six times its variance there. 1.4826 makes the
    # median of magnitudes a standard deviation, which a few jumps do not move.
    rough = np.diff(displacement, 2)
    noise = 1.4826 * float(np.median(np.abs(rough))) / 6**0.5 if len(rough) else 0.0
    return max(SMALLEST_TRAVEL, 8 * noise, 0.003 * float(np.ptp(displacement)))


def find_strokes(displacement: Array, travel: float) -> list[Stroke]:
    """The strokes of a motion, one after the other.

    Args:
        displacement: [m], shape (samples,).
        travel: [m] that the motion must turn back by before its extreme counts as a turning point.
    """
    turns = _turning_points(displacement.tolist(), travel)
    return [_stroke(displacement, start, stop) for start, stop in pairwise(turns)]


def _turning_points(positions: list[float], travel: float) -> list[int]:
    """Samples of the extremes; the first is sample 0, whether the motion turns there or not."""
    turns, direction, extreme = [0], 0, 0
    low = high = positions[0]
    for i, position in enumerate(positions):
        if direction == 0:
            low, high = min(low, position), max(high, position)
            direction = (position - low > travel) - (high - position > travel)
            extreme = i
        elif (position - positions[extreme]) * direction > 0:
            extreme = i
        elif (positions[extreme] - position) * direction > travel:
            turns.append(extreme)
            direction, extreme = -direction, i
    return [*turns, extreme] if direction else turns


def _stroke(displacement: Array, start: int, stop: int) -> Stroke:
    """One stroke, its middle interpolated between two samples."""
    part = displacement[start : stop + 1]
    middle = (part[0] + part[-1]) / 2
    beyond = part >= middle if part[-1] >= part[0] else part <= middle
    i = max(int(np.argmax(beyond)), 1)
    rise = part[i] - part[i - 1] if len(part) > 1 else 0.0
    at = i - 1 + (float((middle - part[i - 1]) / rise) if rise else 0.0)
    return Stroke(start, stop, abs(float(part[-1] - part[0])) / 2, start + at)


def find_holds(
    displacement: Array, strokes: Sequence[Stroke], travel: float, rate: float
) -> list[tuple[int, int]]:
    """Where the motion rests, as samples (start, stop).

    A slow sine rests at its turning points too, so a rest must also last for much of the strokes it touches.

    Args:
        displacement: [m], shape (samples,).
        strokes: all of them.
        travel: [m] within which the motion is at rest.
        rate: [Hz].
    """
    window = max(3, round(_STILL * rate))
    reach = maximum_filter1d(displacement, window) - minimum_filter1d(displacement, window)
    holds = []
    for start, stop in true_runs(reach <= travel):
        # Where the window rests, so does half of it before its middle and behind.
        start, stop = max(0, start - window // 2), min(len(displacement), stop + window // 2)
        touched = [stroke for stroke in strokes if stroke.start < stop and stroke.stop > start]
        # The turning point of a slow sine lasts for a small part of its two strokes only.
        around = max((s.stop for s in touched), default=0) - min((s.start for s in touched), default=0)
        if stop - start >= _MUCH * around:
            holds.append((start, stop))
    return holds


def true_runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """The stretches where a mask is true, as (start, stop)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def steady_runs(strokes: Sequence[Stroke]) -> list[list[Stroke]]:
    """Groups of at least four strokes, one after the other, that repeat in amplitude and duration."""
    runs: list[list[Stroke]] = []
    run: list[Stroke] = []
    for stroke in strokes:
        if run and not _continues(run, stroke):
            runs.append(run)
            run = [run[-1]] if _continues(run[-1:], stroke) else []
        run = [*run, stroke]
    return [run for run in [*runs, run] if len(run) >= _STEADY]


def _continues(run: Sequence[Stroke], stroke: Stroke) -> bool:
    recent = run[-4:]
    amplitude = float(np.median([s.amplitude for s in recent]))
    if abs(stroke.amplitude - amplitude) > _SAME_SIZE * amplitude:
        return False
    if len(recent) < 2:
        return True
    pace = (recent[-1].middle - recent[0].middle) / (len(recent) - 1)
    return abs(stroke.middle - recent[-1].middle - pace) <= _SAME_PACE * pace


def half_period(run: Sequence[Stroke]) -> float:
    """Mean time from stroke to stroke [samples]."""
    return (run[-1].middle - run[0].middle) / (len(run) - 1)


def fit_sine(displacement: Array, half: float, fitted: slice, wanted: slice) -> SineFit:
    """Lay a sine of known period through some samples and evaluate it at others.

    Args:
        displacement: [m], shape (samples,).
        half: half its period [samples].
        fitted: samples that it is fitted to.
        wanted: samples that it is evaluated at.
    """

    def shapes(at: slice) -> Array:
        phase = np.pi * np.arange(at.start, at.stop) / half
        return np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(phase))])

    basis = shapes(fitted)
    weights = np.linalg.lstsq(basis, displacement[fitted], rcond=None)[0]
    amplitude = float(np.hypot(weights[0], weights[1]))
    rest = displacement[fitted] - basis @ weights
    return SineFit(amplitude, float(np.sqrt(np.mean(rest**2))) / max(amplitude, 1e-12), shapes(wanted) @ weights)
