"""Half cycles of a recorded motion, and groups of them that repeat as a sine.

A half cycle is the motion between two successive turning points. Its amplitude is half its travel. Its time is
where it crosses its own middle: noise shifts this crossing much less than a turning point.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MIN_TRAVEL = 20e-6
"""Threshold on travel [m]: below it, a motion is rest or noise."""

_MIN_HOLD_TIME = 0.25
"""Shortest rest [s] that counts as a hold."""

_MIN_SINE_COUNT = 3
"""Smallest number of repeating half cycles that count as a sine: in two cycles from zero to zero."""

_AMPLITUDE_TOLERANCE, _TIME_TOLERANCE = 0.05, 0.04
"""Largest relative differences in amplitude and time between half cycles that repeat."""

_MIN_HOLD_SHARE = 0.4
"""Smallest duration of a hold as a share of the half cycles that it overlaps."""


@dataclass(frozen=True)
class HalfCycle:
    """Motion between two successive turning points."""

    start: int
    """Sample of the first turning point."""
    stop: int
    """Sample of the second turning point."""
    amplitude: float
    """Half the travel [m]."""
    middle: float
    """Position [samples] at which the motion crosses the middle of the travel."""


@dataclass(frozen=True)
class SineFit:
    """A sine fitted to samples."""

    amplitude: float
    """[m]"""
    misfit: float
    """Root mean square residual over the amplitude [1]."""
    curve: Array
    """Sine at the requested samples [m]."""


def estimate_min_travel(displacement: Array) -> float:
    """Estimate the smallest travel [m] above the noise.

    It is the largest of eight standard deviations of the noise, 0.3 % of the range, and 20 µm.
    """
    # Second differences hardly contain motion; white noise has six times its variance there. The factor 1.4826
    # turns a median magnitude into a standard deviation that does not depend on a few jumps.
    differences = np.diff(displacement, 2)
    noise = 1.4826 * float(np.median(np.abs(differences))) / 6**0.5 if len(differences) else 0.0
    return max(MIN_TRAVEL, 8 * noise, 0.003 * float(np.ptp(displacement)))


def find_half_cycles(displacement: Array, travel: float) -> list[HalfCycle]:
    """Find the half cycles of a motion, in order and without gaps.

    Args:
        displacement: [m], shape (samples,).
        travel: smallest travel [m] back from an extreme that makes it a turning point.
    """
    turns = _find_turning_points(displacement.tolist(), travel)
    return [_make_half_cycle(displacement, start, stop) for start, stop in pairwise(turns)]


def _find_turning_points(positions: list[float], travel: float) -> list[int]:
    """Return the samples of the turning points, and sample 0 in any case."""
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


def _make_half_cycle(displacement: Array, start: int, stop: int) -> HalfCycle:
    """Make a half cycle; its middle is interpolated between two samples."""
    part = displacement[start : stop + 1]
    middle = (part[0] + part[-1]) / 2
    beyond = part >= middle if part[-1] >= part[0] else part <= middle
    i = max(int(np.argmax(beyond)), 1)
    rise = part[i] - part[i - 1] if len(part) > 1 else 0.0
    offset = i - 1 + (float((middle - part[i - 1]) / rise) if rise else 0.0)
    return HalfCycle(start, stop, abs(float(part[-1] - part[0])) / 2, start + offset)


def find_holds(
    displacement: Array, half_cycles: Sequence[HalfCycle], travel: float, rate: float
) -> list[tuple[int, int]]:
    """Find the intervals in which the motion rests, as samples (start, stop).

    A slow sine also rests at its turning points. A hold must therefore last for a large part of the half cycles
    that it overlaps.

    Args:
        displacement: [m], shape (samples,).
        half_cycles: all half cycles of the motion.
        travel: largest travel [m] of a motion at rest.
        rate: sampling rate [Hz].
    """
    # Only here: the service loads this module at its start, and the package takes half a second.
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    window = max(3, round(_MIN_HOLD_TIME * rate))
    travels = maximum_filter1d(displacement, window) - minimum_filter1d(displacement, window)
    holds = []
    for start, stop in find_true_intervals(travels <= travel):
        # A window at rest covers half its length before and after its middle.
        start, stop = max(0, start - window // 2), min(len(displacement), stop + window // 2)
        overlapping = [cycle for cycle in half_cycles if cycle.start < stop and cycle.stop > start]
        # The rest at a turning point of a slow sine is a small part of its two half cycles.
        length = max((c.stop for c in overlapping), default=0) - min((c.start for c in overlapping), default=0)
        if stop - start >= _MIN_HOLD_SHARE * length:
            holds.append((start, stop))
    return holds


def find_true_intervals(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the intervals in which a mask is true, as (start, stop)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def find_steady_groups(half_cycles: Sequence[HalfCycle]) -> list[list[HalfCycle]]:
    """Find groups of at least three successive half cycles that repeat in amplitude and duration."""
    groups: list[list[HalfCycle]] = []
    group: list[HalfCycle] = []
    for half_cycle in half_cycles:
        if group and not _is_continuation(group, half_cycle):
            groups.append(group)
            group = [group[-1]] if _is_continuation(group[-1:], half_cycle) else []
        group = [*group, half_cycle]
    return [group for group in [*groups, group] if len(group) >= _MIN_SINE_COUNT]


def _is_continuation(group: Sequence[HalfCycle], half_cycle: HalfCycle) -> bool:
    recent = group[-4:]
    amplitude = float(np.median([cycle.amplitude for cycle in recent]))
    if abs(half_cycle.amplitude - amplitude) > _AMPLITUDE_TOLERANCE * amplitude:
        return False
    if len(recent) < 2:
        return True
    half_period = (recent[-1].middle - recent[0].middle) / (len(recent) - 1)
    return abs(half_cycle.middle - recent[-1].middle - half_period) <= _TIME_TOLERANCE * half_period


def estimate_half_period(group: Sequence[HalfCycle]) -> float:
    """Estimate the mean time between half cycles [samples]."""
    return (group[-1].middle - group[0].middle) / (len(group) - 1)


def fit_sine(displacement: Array, half_period: float, fitted: slice, evaluated: slice) -> SineFit:
    """Fit a sine of known period to some samples and evaluate it at others.

    Args:
        displacement: [m], shape (samples,).
        half_period: half the period [samples].
        fitted: samples to which the sine is fitted.
        evaluated: samples at which it is evaluated.
    """
    basis = _compute_sine_basis(fitted, half_period)
    weights = np.linalg.lstsq(basis, displacement[fitted], rcond=None)[0]
    amplitude = float(np.hypot(weights[0], weights[1]))
    residual = displacement[fitted] - basis @ weights
    misfit = float(np.sqrt(np.mean(residual**2))) / max(amplitude, 1e-12)
    return SineFit(amplitude, misfit, _compute_sine_basis(evaluated, half_period) @ weights)


def _compute_sine_basis(samples: slice, half_period: float) -> Array:
    """Return cosine, sine and constant at some samples, shape (samples, 3)."""
    phase = np.pi * np.arange(samples.start, samples.stop) / half_period
    return np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(phase))])
