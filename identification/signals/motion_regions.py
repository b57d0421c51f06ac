"""Division of a stretch into regions: repeating strokes, transitions, other motion, rests, disturbances.

A disturbance is a short departure of the rod from the wave that it repeats: a late setpoint, or a shock. It is
smoothed as a region of its own, because its fast motion would let noise into the whole segment. Far off the wave,
the motion between samples is unknown, and a force that is steep over some micrometres cannot be simulated there.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, uniform_filter1d

from identification.arrays import Array, BoolArray
from identification.logs import Stretch
from identification.signals.drive import find_drive_steps
from identification.signals.harmonics import Harmonics

Indices = npt.NDArray[np.intp]

_REST_WINDOW = 0.1
"""Time [s] over which the displacement must vary by noise alone for the rod to count as at rest."""
REST_CUTOFF = 0.5 / _REST_WINDOW
"""Frequency [Hz] above which a motion would show in that window."""
_SHORT_MOTION = 4.0 * _REST_WINDOW
"""Time [s] up to which a motion beside a rest is a transition: too few samples for a cutoff of its own."""
_REST_DEVIATIONS = 4.0
"""Excess of the variance in that window up to which it is noise alone [standard deviations]."""
_TRANSITION_TIME = 0.03
"""Time [s] left for transients around disturbances and around the ends of periodic parts."""
MAX_COMPLIANCE_MOTION = 0.03
"""Threshold on compliance motion over the stroke's standard deviation: above it, it cannot be the actuator's."""
_UNRESOLVED_FRACTION = 0.004
"""Threshold on a disturbance over the stroke's standard deviation: above it, its samples are unresolved."""


class MotionRegions(NamedTuple):
    """Division of a stretch, (N,) each."""

    regions: Indices
    """Region of each sample: 0 for transitions, then repeating parts, motion between them, rests, disturbances."""
    rest: BoolArray
    """True where the rod rests."""
    unpredicted: BoolArray
    """True where neither a repeating part nor a rest predicts the motion."""
    disturbed: BoolArray
    """True in a disturbance."""
    unresolved: BoolArray
    """True in a disturbance so large that the motion between samples is unknown."""


def divide_stretch(stretch: Stretch, waves: list[Harmonics], is_compliant: bool, noise: float) -> MotionRegions:
    """Divide a stretch into regions.

    Args:
        stretch: the recording.
        waves: its repeating parts.
        is_compliant: whether its actuator deforms under load, which adds transitions at the stretch's ends.
        noise: standard deviation of the displacement's noise [m].
    """
    count, reach = len(stretch.time), _compute_reach(stretch)
    edges = {edge for wave in waves for edge in (wave.start, wave.stop)} - {0, count}
    transitions = _mark_around(edges | ({0, count} if is_compliant else set()), count, reach)
    deviation = np.zeros(count)
    for wave in waves:
        deviation[wave.start : wave.stop] = wave.disturbance
    disturbances = find_disturbances(stretch, deviation)
    disturbed = mark_runs(disturbances, count)
    large = disturbed & (deviation > _UNRESOLVED_FRACTION * _compute_amplitude(stretch))
    occupied = transitions | disturbed | mark_runs([np.arange(w.start, w.stop) for w in waves], count)
    rest = _find_rest(stretch, noise) & ~occupied
    regions = _label_regions(waves, transitions, rest, disturbances, _SHORT_MOTION * stretch.rate)
    unpredicted = ~rest & ((regions == 0) | (regions > len(waves)))
    return MotionRegions(regions, rest, unpredicted, disturbed, _widen(large, reach))


def _find_rest(stretch: Stretch, noise: float) -> BoolArray:
    """Return a mask (N,) of the samples in whose surroundings the displacement varies by noise alone.

    A cutoff that passes the fast motion of a segment would pass noise where the rod rests in the same segment.
    """
    window = max(int(_REST_WINDOW * stretch.rate), 2)
    x = stretch.displacement - np.mean(stretch.displacement)
    variance = uniform_filter1d(x**2, window) - uniform_filter1d(x, window) ** 2
    still = _find_runs(variance < (1.0 + _REST_DEVIATIONS * np.sqrt(2.0 / window)) * noise**2)
    # A slow reversal is still for less than a window.
    return mark_runs([run for run in still if len(run) >= window], len(x))


def find_disturbances(stretch: Stretch, deviation: Array) -> list[Indices]:
    """Return the samples of each disturbance.

    A small departure that begins at a change of drive or stroke is the actuator's response and not a disturbance.
    ``deviation`` (N,) is the distance of the rod from its wave in candidate disturbances [m], and 0 elsewhere.
    """
    if not deviation.any():
        return []
    reach = _compute_reach(stretch)
    seams = {s.start for s in stretch.segments} & {s.stop for s in stretch.segments}
    changes = _mark_around(seams | set(find_drive_steps(stretch.drive).tolist()), len(deviation), reach)
    runs = _find_runs(_widen(deviation > 0.0, reach))
    # The runs were widened: the disturbance itself begins a reach later.
    starts = [min(run[0] + reach, len(deviation) - 1) for run in runs]
    limit = MAX_COMPLIANCE_MOTION * _compute_amplitude(stretch)
    return [
        run for run, start in zip(runs, starts, strict=True) if not changes[start] or deviation[run].max() > limit
    ]


def _compute_reach(stretch: Stretch) -> int:
    return int(_TRANSITION_TIME * stretch.rate) + 1


def _compute_amplitude(stretch: Stretch) -> float:
    return float(np.std(stretch.displacement)) or 1.0


def _mark_around(edges: set[int], count: int, reach: int) -> BoolArray:
    """Return a mask (count,) of the samples around some edges."""
    mask = np.zeros(count, bool)
    for edge in edges:
        mask[max(edge - reach, 0) : edge + reach] = True
    return mask


def _label_regions(
    waves: list[Harmonics], transitions: BoolArray, rest: BoolArray, disturbances: list[Indices], shortest: float
) -> Indices:
    """Return the region (N,) of each sample, in the order that `MotionRegions` states.

    A motion beside a rest that has fewer samples than ``shortest`` is a transition: a start or a stop.
    """
    # A transition overrides the wave that it overlaps, a disturbance overrides both.
    regions = np.full(len(transitions), -1)
    for k, wave in enumerate(waves):
        regions[wave.start : wave.stop] = 1 + k
    regions[transitions] = 0
    beside_rest = _widen(rest, 1)
    moving = _find_runs((regions < 0) & ~rest)
    starts = [run for run in moving if len(run) < shortest and beside_rest[run].any()]
    regions[mark_runs(starts, len(regions))] = 0
    runs = [*_find_runs((regions < 0) & ~rest), *_find_runs((regions < 0) & rest), *disturbances]
    for k, run in enumerate(runs, 1 + len(waves)):
        regions[run] = k
    return regions


def mark_runs(runs: list[Indices], count: int) -> BoolArray:
    """Return a mask (count,) of the samples of some runs."""
    mask = np.zeros(count, bool)
    for run in runs:
        mask[run] = True
    return mask


def _widen(mask: BoolArray, reach: int) -> BoolArray:
    """Return the mask (N,) with ``reach`` samples added on either side."""
    return np.asarray(binary_dilation(mask, iterations=reach)) if mask.any() else mask


def _find_runs(mask: BoolArray) -> list[Indices]:
    """Return the indices of each run of True in a mask (N,)."""
    indices = np.flatnonzero(mask)
    return np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1) if len(indices) else []
