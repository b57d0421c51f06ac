"""Noise floor of the recorded force: the part that no model of the damper can explain.

Two estimates need no model. **Cycle to cycle**: where motion and drive repeat, the difference of the forces of two
successive cycles has twice the variance of the noise. **High frequency**: fourth differences contain only the part
that is too fast for a damper. Their median ignores the corners of a hysteresis loop.

On white noise the two agree. A larger cycle-to-cycle estimate points to drift, stick-slip, heating or coloured
noise. A smaller one points to hum locked to the stroke, or to sampling that is too slow.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.logs import PERIODIC_MOTIONS, Segment, Stretch
from identification.signals.harmonics import find_steady_cycles
from identification.signals.motion import Motion
from identification.signals.noise import estimate_deviation
from identification.signals.smoother import compute_penalty, differentiate, smooth_signal

_SETTLING_TIME = 0.1
"""Time [s] after a change of motion or drive that is not used."""
_AGREEMENT_RATIO = 1.1
"""Threshold on the ratio of the two estimates: up to it, they agree."""
_MIN_SAMPLES = 200
"""Smallest number of independent samples in repeated cycles for an estimate."""
_MIN_PAIR_SAMPLES = 50
"""Smallest number of comparable samples in two cycles."""
_MOTION_RATIO = 2.0
"""Threshold on the motion difference of two cycles over that of the best quarter: above it, they do not repeat."""
_SAME_MOTION = 2e-4
"""Motion difference over the displacement's standard deviation up to which two cycles always repeat."""
_MAX_HARMONIC = 6.0
"""Multiple of the stroke's frequency up to which its motion may differ from cycle to cycle."""


@dataclass(frozen=True)
class NoiseFloorEstimate:
    """Noise of a recorded force."""

    noise: float
    """Noise floor [N]."""
    cycle_to_cycle: float | None
    """Estimate from repeated cycles [N]; None if no cycles repeat."""
    high_frequency: float
    """Estimate from fourth differences [N]."""
    basis: str
    """Estimate on which ``noise`` rests, and the reason, as text for a person."""


class _CyclePairs(NamedTuple):
    """Differences between successive cycles, at n samples."""

    force: Array
    """(n,) force difference [N]."""
    motion: Array
    """(3, n) differences of displacement [m], velocity [m/s] and acceleration [m/s²]."""
    velocity: Array
    """(n,) velocity [m/s], not its difference."""
    cycle: npt.NDArray[np.intp]
    """(n,) index of the cycle."""
    motion_difference: Array
    """(cycles,) root mean square displacement difference to the previous cycle [m]."""
    variance_ratio: float
    """Variance of a difference of white noise over that of the noise (dimensionless)."""


class _RepeatStatistics(NamedTuple):
    """Noise in repeated cycles."""

    squares: float
    """Sum of squared noise [N²]."""
    degrees_of_freedom: float
    """Number of independent samples."""
    cycles: int


def estimate_floor(stretch: Stretch, motion: Motion) -> NoiseFloorEstimate:
    """Estimate the noise of the force of one stretch, without the effect of displacement noise.

    The motion's change from cycle to cycle explains part of the force's change.
    """
    high_frequency = estimate_high_frequency_noise(stretch.force)
    periodic = [s for s in stretch.segments if s.motion in PERIODIC_MOTIONS and s.frequency]
    pairs = [p for s in periodic if (p := _make_cycle_pairs(stretch, motion, s)) is not None]
    limit = max(_find_motion_limit(pairs), _SAME_MOTION * float(np.std(stretch.displacement)))
    repeats = [_compute_repeat_statistics(p, limit) for p in pairs]
    freedom = sum(r.degrees_of_freedom for r in repeats)
    if freedom < _MIN_SAMPLES:
        reason = _explain_missing_repeats(stretch, freedom)
        return NoiseFloorEstimate(high_frequency, None, high_frequency, f"high frequency: {reason}")
    cycle_to_cycle = math.sqrt(sum(r.squares for r in repeats) / freedom)
    noise, comparison = _combine_estimates(cycle_to_cycle, high_frequency)
    cycles = sum(r.cycles for r in repeats)
    basis = f"cycle to cycle over {cycles} cycles; {comparison}"
    return NoiseFloorEstimate(noise, cycle_to_cycle, high_frequency, basis)


def combine_floors(stretches: Sequence[Stretch], floors: Sequence[NoiseFloorEstimate]) -> NoiseFloorEstimate:
    """Return the common noise floor of several stretches, each weighted by its measured samples."""
    counts = np.array([np.count_nonzero(s.measured) for s in stretches], float)
    cycle_to_cycle = np.array([np.nan if f.cycle_to_cycle is None else f.cycle_to_cycle for f in floors])
    known = np.isfinite(cycle_to_cycle)
    return NoiseFloorEstimate(
        _average_noise(np.array([f.noise for f in floors]), counts),
        _average_noise(cycle_to_cycle[known], counts[known]) if known.any() else None,
        _average_noise(np.array([f.high_frequency for f in floors]), counts),
        floors[0].basis if len(floors) == 1 else _describe_basis(floors),
    )


def estimate_high_frequency_noise(force: Array) -> float:
    """Return the standard deviation [N] of the white noise in a force (N,), by the median of fourth differences.

    The channel's own filter does not shape this noise, which is added where the force is digitised. The force is
    dithered by half a digit first, because the median of a few coarse steps is inexact.
    """
    levels = np.unique(np.abs(np.diff(force)))
    digit = float(np.min(levels[levels > 1e-9 * np.ptp(force)], initial=np.ptp(force)))
    dither = digit * (np.random.default_rng(0).random(len(force)) - 0.5)
    # 0.6744898: median magnitude of a normal variable of variance 1; 70: variance of its fourth difference.
    noise = float(np.median(np.abs(np.diff(force + dither, 4)))) / 0.6744898 / math.sqrt(70.0)
    return math.sqrt(max(noise**2 - digit**2 / 12.0, 0.0)) if digit < noise * 10.0 else noise


def _combine_estimates(cycle_to_cycle: float, high_frequency: float) -> tuple[float, str]:
    """Return the noise [N] to use, and the comparison of the two estimates as text."""
    ratio = 1.0 if cycle_to_cycle == high_frequency else cycle_to_cycle / max(high_frequency, 1e-12)
    if 1.0 / _AGREEMENT_RATIO <= ratio <= _AGREEMENT_RATIO:
        return math.sqrt(cycle_to_cycle * high_frequency), "the high-frequency estimate agrees"
    if ratio > 1.0:
        comparison = (
            f"{ratio:.2f} times the high-frequency estimate: some force does not repeat, or the noise is coloured"
        )
        return cycle_to_cycle, comparison
    return cycle_to_cycle, f"only {ratio:.2f} of the high-frequency estimate: fast force repeats with the stroke"


def _explain_missing_repeats(stretch: Stretch, freedom: float) -> str:
    if not any(s.motion in PERIODIC_MOTIONS for s in stretch.segments):
        return "no periodic motion, so no cycles repeat"
    if freedom <= 0:
        return "no two cycles with the same steady motion and drive"
    return f"only {freedom:.0f} samples in repeated cycles (minimum {_MIN_SAMPLES})"


def _describe_basis(floors: Sequence[NoiseFloorEstimate]) -> str:
    """Return the number of stretches that rest on each estimate, as text."""
    repeated = [f for f in floors if f.cycle_to_cycle is not None]
    if not repeated:
        return floors[0].basis
    differing = [f for f in repeated if "agrees" not in f.basis]
    text = f"cycle to cycle in {len(repeated)} of {len(floors)} stretches"
    if len(repeated) < len(floors):
        text += ", high frequency in the others"
    if differing:
        text += f"; the two estimates differ by more than {_AGREEMENT_RATIO - 1:.0%} in {len(differing)}"
    return text


def _average_noise(noise: Array, counts: Array) -> float:
    return float(np.sqrt(np.sum(noise**2 * counts) / np.sum(counts)))


def _make_cycle_pairs(stretch: Stretch, motion: Motion, segment: Segment) -> _CyclePairs | None:
    """Compare each cycle of a segment with the previous one; return None if motion or drive never repeat."""
    part = slice(segment.start, segment.stop)
    weights = stretch.measured[part].astype(float)
    planned_frequency = segment.frequency or 0.0
    cycles = find_steady_cycles(motion.displacement[part], weights, stretch.rate, planned_frequency, motion.noise)
    if cycles is None:
        return None
    steady = slice(segment.start + cycles.start, segment.start + cycles.stop)
    lag = stretch.rate / cycles.frequency
    force_difference, variance_ratio = _subtract_previous_cycle(stretch.force[steady], lag)
    low_passed = _filter_motion(stretch, steady, cycles.frequency)
    differences = np.stack([_subtract_previous_cycle(x, lag)[0] for x in low_passed])
    repeating = _find_repeating_samples(stretch.drive[steady], stretch.measured[steady], lag, stretch.rate)
    if np.count_nonzero(repeating) < _MIN_PAIR_SAMPLES:
        return None
    cycle = np.unique((np.arange(len(force_difference)) / lag).astype(int)[repeating], return_inverse=True)[1]
    motion_difference = np.sqrt(np.bincount(cycle, differences[0, repeating] ** 2) / np.bincount(cycle))
    velocity = low_passed[1][-len(force_difference) :]
    return _CyclePairs(
        force_difference[repeating],
        differences[:, repeating],
        velocity[repeating],
        cycle,
        motion_difference,
        variance_ratio,
    )


def _find_motion_limit(pairs: Sequence[_CyclePairs]) -> float:
    """Return the motion difference [m] above which two cycles do not repeat.

    After a disturbance the force differs too. A force that is steep over some micrometres is not explained by
    terms that are linear in the difference.
    """
    differences = [p.motion_difference for p in pairs]
    return _MOTION_RATIO * float(np.quantile(np.concatenate(differences), 0.25)) if differences else 0.0


def _compute_repeat_statistics(pairs: _CyclePairs, limit: float) -> _RepeatStatistics:
    """Return the noise between cycles whose motion differs by at most a limit [m]."""
    repeated = (pairs.motion_difference <= limit)[pairs.cycle]
    if np.count_nonzero(repeated) < _MIN_PAIR_SAMPLES:
        return _RepeatStatistics(0.0, 0.0, 0)
    cycle = pairs.cycle[repeated]
    terms = _make_motion_terms(pairs.motion[:, repeated], pairs.velocity[repeated])
    noise, freedom = _remove_explained(pairs.force[repeated], terms, cycle)
    return _RepeatStatistics(float(noise @ noise) / pairs.variance_ratio, freedom, len(np.unique(cycle)))


def _filter_motion(stretch: Stretch, steady: slice, frequency: float) -> tuple[Array, Array, Array]:
    """Return displacement, velocity and acceleration up to some harmonics, from the displacement alone.

    The estimated motion may contain a trace of the force's own noise, which would explain itself here.
    """
    x = stretch.displacement[steady]
    cutoff = min(_MAX_HARMONIC * frequency, 0.2 * stretch.rate)
    penalty = np.full(len(x) - 3, float(compute_penalty(cutoff, stretch.rate)))
    x = smooth_signal(x, stretch.measured[steady].astype(float), penalty, np.zeros(len(x) - 3))
    velocity = differentiate(x, stretch.rate)
    return x, velocity, differentiate(velocity, stretch.rate)


def _subtract_previous_cycle(values: Array, lag: float) -> tuple[Array, float]:
    """Subtract from each sample the one a cycle before.

    Args:
        values: (N,) signal.
        lag: samples in a cycle, not necessarily whole; a cubic interpolates between samples and averages noise.

    Returns:
        (N - n,) differences of the last samples, and their variance for white noise of variance 1.
    """
    whole = math.floor(lag)
    weights = _make_cubic_weights(lag - whole)
    before = np.convolve(values, weights[::-1], "valid")
    skip = whole + 2
    return values[skip:] - before[: len(values) - skip], float(1.0 + weights @ weights)


def _make_cubic_weights(t: float) -> Array:
    """Return Lagrange's weights of four samples at -1, 0, 1 and 2 for the value at -t."""
    return np.array(
        [
            (t + 1.0) * t * (t - 1.0) / 6.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -t * (t - 1.0) * (t - 2.0) / 6.0,
        ]
    )


def _find_repeating_samples(drive: Array, measured: BoolArray, lag: float, rate: float) -> BoolArray:
    """Return a mask, aligned with cycle differences, of samples whose recent drive equals that a cycle before."""
    skip, settling = math.floor(lag) + 2, math.ceil(_SETTLING_TIME * rate)
    whole = round(lag)
    steps = np.diff(drive)
    noise = estimate_deviation(steps - np.median(steps)) / math.sqrt(2.0)
    tolerance = max(6.0 * noise, 2e-3 * np.ptp(drive))
    differs = np.abs(drive[skip:] - drive[skip - whole : len(drive) - whole]) > tolerance
    differs |= ~measured[skip:] | ~measured[skip - whole : len(drive) - whole]
    # Before the first of these samples, the recent past of the drive is unknown.
    differs[:settling] = True
    recent_differences = np.convolve(differs, np.ones(settling + 1), "full")[: len(differs)]
    return np.asarray(recent_differences < 0.5)


def _make_motion_terms(differences: Array, velocity: Array) -> Array:
    """Return (6, n) differences of displacement, velocity and acceleration, everywhere and near the reversals."""
    slow = np.exp(-((velocity / (0.1 * np.std(velocity) + 1e-12)) ** 2))
    scaled = differences / (np.std(differences, axis=1, keepdims=True) + 1e-12)
    return np.concatenate([scaled, scaled * slow])


def _remove_explained(difference: Array, terms: Array, cycle: npt.NDArray[np.intp]) -> tuple[Array, float]:
    """Return a difference without the means of its cycles and the terms, and its degrees of freedom."""
    names, cycle = np.unique(cycle, return_inverse=True)
    counts = np.bincount(cycle)

    def centre(values: Array) -> Array:
        return np.asarray(values - (np.bincount(cycle, values) / counts)[cycle])

    difference = centre(difference)
    terms = np.stack([centre(term) for term in terms])
    amplitudes = np.linalg.lstsq(terms @ terms.T, terms @ difference, rcond=1e-9)[0]
    return difference - amplitudes @ terms, float(len(difference) - len(names) - len(terms))
