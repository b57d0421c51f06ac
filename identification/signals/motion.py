"""Displacement, velocity and acceleration of a stretch, from a displacement with noise and steps.

Velocity enters the force through c0, so noise of the displacement becomes noise of the force. A plain difference
of 2 µm noise at 1 kHz is 2.8 mm/s, which at 2000 N s/m is some 6 N. The known parts of the motion are used in
turn:

1. The actuator deforms under load. The displacement is regressed on the recorded force at lags of -6 to 45 ms, if
   it follows the force at all (actuator_compliance.py).
2. A periodic stroke repeats. Its harmonics are fitted over all segments through which it continues (harmonics.py).
3. The remainder is smoothed with twicing (smoother.py), towards the third differences of parts 1 and 2. The cutoff
   of each region minimises the estimated error of the *velocity* (cutoff.py). Regions are periodic segments, the
   motion between them, and transitions (motion_regions.py). Rests have the lowest cutoff. A common cutoff for
   fades, moves and holds would distort the fades by micrometres, and with them k0 and k1. Between two regions
   the cutoff changes gradually.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.logs import PERIODIC_MOTIONS, Segment, Stretch
from identification.signals.actuator_compliance import MAX_LAG, choose_stroke_cutoff, estimate_compliance_motion
from identification.signals.cutoff import LOWEST_CUTOFF, choose_cutoffs, find_distortions, limit_length_slope
from identification.signals.harmonics import Harmonics, find_steady_cycles, fit_harmonics
from identification.signals.motion_regions import (
    REST_CUTOFF,
    MotionRegions,
    divide_stretch,
    find_disturbances,
    mark_runs,
)
from identification.signals.smoother import compute_penalty, differentiate, smooth_signal

_MAX_RUN = 30.0
"""Length [s] up to which segments of one stroke are fitted together; longer ones average enough by themselves."""
_MIN_STEADY_SHARE = 0.9
"""Threshold on the steady share of a run: below it, its segments are fitted one by one."""
_END_LOOSENING = 1.5
"""Factor on the cutoff at the ends of a stretch. Origin: with 2, noise there grows by up to half."""
_USED_FRACTION, _USED_VARIANCE = 0.99, 0.92476
"""Fraction of the fourth differences that are used, and mean square of that fraction of a normal distribution."""


class Motion(NamedTuple):
    """Motion of a stretch, (N,) each; velocity and acceleration are derivatives of the displacement."""

    displacement: Array
    """Displacement [m]."""
    velocity: Array
    """Velocity [m/s]."""
    acceleration: Array
    """Acceleration [m/s²]."""
    noise: float
    """Standard deviation of the recorded displacement's noise [m]."""
    cutoff: Array
    """Cutoff of the smoother at each sample [Hz]."""
    stroke_cutoff: float
    """Frequency below which the displacement is the stroke, and not compliance motion [Hz]."""
    unresolved: BoolArray
    """True in a disturbance so large that the motion between samples is unknown."""
    description: tuple[str, ...]
    """Method of estimation as text, one entry a segment, or one for a stretch without segments."""


def estimate_motion(stretch: Stretch, similar: Motion | None = None) -> Motion:
    """Estimate the motion behind the recorded displacement of a stretch.

    Args:
        stretch: stretch with the segments of its method, as far as they are known.
        similar: motion of a similar recording, whose cutoffs are taken; they are chosen if None.

    Returns:
        The motion on the stretch's own time base.
    """
    weights = stretch.measured.astype(float)
    noise = estimate_recorded_noise(stretch)
    # Disturbances mask compliance motion in the regression, so they are found first (decision 0013).
    disturbed = _find_rough_disturbances(stretch, weights, noise)
    undisturbed = np.where(disturbed, 0.0, weights)
    stroke_cutoff = (
        similar.stroke_cutoff
        if similar
        else choose_stroke_cutoff(stretch.displacement, undisturbed, stretch.rate, noise)
    )
    compliance_motion = estimate_compliance_motion(stretch, undisturbed, stroke_cutoff)
    is_compliant = bool(np.any(compliance_motion))
    waves = _fit_periodic_parts(stretch, weights, compliance_motion, noise)
    regions = divide_stretch(stretch, waves, is_compliant, noise)
    expected = _make_expected_differences(compliance_motion, waves, int(MAX_LAG * stretch.rate))
    cutoff = similar.cutoff if similar else _choose_cutoff(stretch, weights, expected, regions, noise)
    # A third difference spans four samples; its cutoff is that of the second.
    penalty = compute_penalty(_raise_end_cutoffs(cutoff, stretch.rate)[1:-2], stretch.rate)
    displacement = smooth_signal(stretch.displacement, weights, penalty, expected, twicing=True)
    velocity, from_record = _choose_velocity(stretch, displacement)
    remainder = (stretch.displacement - displacement)[stretch.measured]
    return Motion(
        displacement,
        velocity,
        differentiate(velocity, stretch.rate),
        float(np.std(remainder)),
        cutoff,
        stroke_cutoff,
        regions.unresolved,
        _describe_motion(stretch, waves, cutoff, is_compliant, from_record),
    )


def _choose_cutoff(
    stretch: Stretch, weights: Array, expected: Array, regions: MotionRegions, noise: float
) -> Array:
    """Return the cutoff (N,) [Hz] of the smoother."""
    choose = partial(choose_cutoffs, expected=expected, regions=regions.regions, rate=stretch.rate, noise=noise)
    cutoff = choose(stretch.displacement, weights, twicing=True)[regions.regions]
    if regions.disturbed.any():
        # Disturbances must not raise the cutoff of the undisturbed motion around them.
        undisturbed = choose(stretch.displacement, np.where(regions.disturbed, 0.0, weights), twicing=True)
        cutoff = np.where(regions.disturbed, cutoff, undisturbed[regions.regions])
    distorted = regions.unpredicted & find_distortions(
        stretch.displacement, weights, expected, cutoff, stretch.rate
    )
    if distorted.any():
        separate = choose(stretch.displacement, weights, twicing=True, regions=distorted.astype(np.intp))[1]
        cutoff = np.where(distorted, np.maximum(cutoff, separate), cutoff)
    # The motion before and after a rest reaches into it through the smoother and would raise its cutoff.
    cutoff = np.where(regions.rest, max(REST_CUTOFF, LOWEST_CUTOFF * stretch.rate), cutoff)
    # The third differences of rests and waves are predicted, so that a jump of the cutoff does not distort them.
    return np.where(regions.unpredicted, limit_length_slope(cutoff, stretch.rate), cutoff)


def estimate_recorded_noise(stretch: Stretch) -> float:
    """Return the standard deviation [m] of white noise or quantisation in the displacement of a stretch.

    A cubic half-way between two samples removes the fastest noise. Differences of neighbours then show less than
    half of white noise (0.44), those of every other sample nearly all (0.87).
    """
    return estimate_displacement_noise(stretch.displacement, stretch.measured, 2 if stretch.interpolated else 1)


def estimate_displacement_noise(displacement: Array, measured: BoolArray, stride: int = 1) -> float:
    """Return the standard deviation [m] of white noise or quantisation in a displacement (N,).

    Fourth differences are taken over samples ``stride`` apart. The largest hundredth (shocks) is excluded, and the
    result is corrected for it as for a normal distribution.
    """
    parts = [slice(k * stride, len(displacement) - (4 - k) * stride) for k in range(5)]
    # 70 = 1 + 16 + 36 + 16 + 1: variance of the fourth difference of white noise.
    complete = np.all([measured[part] for part in parts], axis=0)
    fourth = np.sum([c * displacement[part] for c, part in zip((1, -4, 6, -4, 1), parts, strict=True)], axis=0)
    squares = fourth[complete] ** 2 / 70.0
    used = squares[squares <= np.quantile(squares, _USED_FRACTION)]
    return float(np.sqrt(np.mean(used) / _USED_VARIANCE))


def _find_rough_disturbances(stretch: Stretch, weights: Array, noise: float) -> BoolArray:
    """Return a mask (N,) of disturbances in periodic strokes, before compliance motion is known."""
    deviation = np.zeros(len(weights))
    for run in _join_segments(stretch):
        part, frequency = slice(run[0].start, run[-1].stop), run[0].frequency or 0.0
        steady = find_steady_cycles(stretch.displacement[part], weights[part], stretch.rate, frequency, noise)
        if steady:
            deviation[part] = steady.disturbance
    return mark_runs(find_disturbances(stretch, deviation), len(deviation))


def _fit_periodic_parts(
    stretch: Stretch, weights: Array, compliance_motion: Array, noise: float
) -> list[Harmonics]:
    """Fit the harmonics of every periodic segment, counted from the stretch's first sample."""
    stroke = stretch.displacement - compliance_motion
    parts = []
    for run in _join_segments(stretch):
        wave = _fit_run(stroke, weights, stretch.rate, run, noise)
        steady = 0 if wave is None else wave.stop - wave.start
        if len(run) > 1 and wave is not None and steady > _MIN_STEADY_SHARE * (run[-1].stop - run[0].start):
            parts += [_cut_wave(wave, segment) for segment in run if _count_overlap(wave, segment) > 0]
        else:
            waves = (
                [wave] if len(run) == 1 else [_fit_run(stroke, weights, stretch.rate, (s,), noise) for s in run]
            )
            parts += [wave for wave in waves if wave is not None]
    return parts


def _join_segments(stretch: Stretch) -> list[tuple[Segment, ...]]:
    """Group periodic segments through which one stroke continues without a stop while the drive changes."""
    runs: list[tuple[Segment, ...]] = []
    for segment in stretch.segments:
        if segment.motion not in PERIODIC_MOTIONS or not segment.frequency:
            continue
        if runs and _is_continued(runs[-1], segment, stretch.rate):
            runs[-1] = (*runs[-1], segment)
        else:
            runs.append((segment,))
    return runs


def _is_continued(run: tuple[Segment, ...], segment: Segment, rate: float) -> bool:
    last = run[-1]
    is_same = (last.motion, last.amplitude, last.frequency) == (
        segment.motion,
        segment.amplitude,
        segment.frequency,
    )
    return is_same and segment.start - last.stop <= 1 and segment.stop - run[0].start <= _MAX_RUN * rate


def _fit_run(
    values: Array, weights: Array, rate: float, run: tuple[Segment, ...], noise: float
) -> Harmonics | None:
    """Fit the harmonics of a run, counted from the stretch's first sample; None if too little of it is steady."""
    start, part = run[0].start, slice(run[0].start, run[-1].stop)
    wave = fit_harmonics(values[part], weights[part], rate, run[0].frequency or 0.0, noise)
    return wave and wave._replace(start=wave.start + start, stop=wave.stop + start)


def _count_overlap(wave: Harmonics, segment: Segment) -> int:
    return min(wave.stop, segment.stop) - max(wave.start, segment.start)


def _cut_wave(wave: Harmonics, segment: Segment) -> Harmonics:
    """Return the part of a run's harmonics in one of its segments."""
    start, stop = max(wave.start, segment.start), min(wave.stop, segment.stop)
    part = slice(start - wave.start, stop - wave.start)
    return wave._replace(start=start, stop=stop, values=wave.values[part], disturbance=wave.disturbance[part])


def _make_expected_differences(compliance_motion: Array, waves: list[Harmonics], unknown: int) -> Array:
    """Return the expected third differences (N-3,) [m] of compliance motion and waves."""
    expected = np.diff(compliance_motion, 3)
    # At the ends the lags reach beyond the recorded force.
    expected[:unknown] = expected[len(expected) - unknown :] = 0.0
    for wave in waves:
        expected[wave.start : wave.stop - 3] += np.diff(wave.values, 3)
    return expected


def _raise_end_cutoffs(cutoffs: Array, rate: float) -> Array:
    """Raise the cutoffs (N,) towards the ends, where a low cutoff would straighten the motion."""
    time = np.arange(len(cutoffs)) / rate
    to_end = np.minimum(time, time[-1] - time)
    return np.asarray(cutoffs * (1.0 + (_END_LOOSENING - 1.0) * np.clip(1.0 - to_end * cutoffs, 0.0, 1.0)))


def _choose_velocity(stretch: Stretch, displacement: Array) -> tuple[Array, bool]:
    """Return the recorded velocity if the force follows it as well as the derivative, and whether it does."""
    derived = differentiate(displacement, stretch.rate)
    if stretch.velocity is None:
        return derived, False
    recorded_wins = _compute_unexplained(stretch, displacement, stretch.velocity) <= _compute_unexplained(
        stretch, displacement, derived
    )
    return (stretch.velocity if recorded_wins else derived), recorded_wins


def _compute_unexplained(stretch: Stretch, displacement: Array, velocity: Array) -> float:
    """Return the force variance [N²] that a damper without memory does not explain.

    The damper has springs, dashpots and two yields. The variance is larger for a velocity with more noise or more
    filtering.
    """
    typical = float(np.std(velocity[stretch.measured])) or 1.0
    dashpots = [velocity, np.tanh(velocity / (0.1 * typical)), np.tanh(velocity / (0.5 * typical))]
    driven = [term * stretch.drive for term in dashpots]
    terms = np.stack([np.ones_like(velocity), stretch.drive, displacement, *dashpots, *driven])[
        :, stretch.measured
    ]
    force = stretch.force[stretch.measured]
    amplitudes = np.linalg.lstsq(terms @ terms.T, terms @ force, rcond=1e-12)[0]
    return float(np.mean((force - amplitudes @ terms) ** 2))


def _describe_motion(
    stretch: Stretch, waves: list[Harmonics], cutoff: Array, is_compliant: bool, from_record: bool
) -> tuple[str, ...]:
    """Return the method of estimation of each segment as text."""
    suffix = ", compliance motion of the actuator" if is_compliant else ""
    suffix += "; velocity as recorded" if from_record else ""
    descriptions = []
    for segment in stretch.segments:
        segment_waves = [wave for wave in waves if segment.start <= wave.start < segment.stop]
        for wave in segment_waves:
            orders = ", ".join(str(order) for order in wave.orders)
            limit = cutoff[(wave.start + wave.stop) // 2]
            descriptions.append(
                f"{wave.frequency:.5g} Hz with harmonics {orders}{suffix}, the remainder below {limit:.3g} Hz"
            )
        if not segment_waves:
            limit = cutoff[(segment.start + segment.stop) // 2]
            descriptions.append(f"smoothed below {limit:.3g} Hz{suffix}")
    return tuple(descriptions) or (f"smoothed below {cutoff[len(cutoff) // 2]:.3g} Hz{suffix}",)
