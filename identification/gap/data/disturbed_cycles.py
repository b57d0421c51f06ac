"""Disturbed cycles: cycles in which the rod did not repeat its stroke.

Late setpoints or a shock move the rod within milliseconds. The motion between samples is then unknown, and a force
that is steep over some micrometres cannot be simulated. The faults of a damper move the rod far less: only by the
compliance of the actuator.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.fitting import Piece
from identification.gap.data.cycles import Cycles, Indices, split_by_piece

_HARMONICS = 12
"""Harmonics in the motion that all cycles of a segment have in common."""
_PHASE_BINS = 50
"""Parts of a cycle in which it is compared with the others."""
_PHASE_ROUNDING = 1e-9
"""Rounding error of a phase [cycles]."""
_JERK_LIMIT = 0.004
"""Smallest jerk of a disturbed cycle, relative to the standard deviation of the stroke."""
_JERK_RATIO = 5.0
"""Smallest jerk of a disturbed cycle, relative to that of the steadiest cycles."""
_STEADIEST_SHARE = 0.1
"""Share of all cycles that counts as the steadiest."""
_MAX_DISTURBED_SHARE = 0.5
"""Threshold on the share of disturbed cycles: above it, all are kept and the recording is reported as bad."""


def mask_disturbed_cycles(pieces: Sequence[Piece], cycles: Cycles) -> tuple[tuple[Piece, ...], list[str]]:
    """Exclude disturbed cycles from the fit, and describe them.

    Where most cycles are disturbed, all are kept, and the note asks for a new recording.
    """
    jerks = measure_disturbance(pieces, cycles)
    known = np.isfinite(jerks)
    if not known.any():
        return tuple(pieces), []
    stroke = float(np.std(np.concatenate([p.excitation.displacement for p in pieces])))
    limit = max(_JERK_LIMIT * stroke, _JERK_RATIO * float(np.quantile(jerks[known], _STEADIEST_SHARE)))
    disturbed = _drop_segment_ends(known & (jerks > limit), cycles)
    if not disturbed.any():
        return tuple(pieces), []
    note = _describe_disturbed(jerks, disturbed, limit)
    if disturbed.mean() > _MAX_DISTURBED_SHARE:
        note += "; no cycle was excluded, and the diagnosis of this recording is unreliable: record again"
        return tuple(pieces), [note]
    return _mask_cycles(pieces, cycles, disturbed), [f"{note}; these cycles were excluded"]


def _describe_disturbed(jerks: Array, disturbed: BoolArray, limit: float) -> str:
    return (
        f"the rod did not repeat its stroke in {np.count_nonzero(disturbed)} of {len(jerks)} cycles (jerk up to "
        f"{1e6 * jerks[disturbed].max():.3g} µm, limit {1e6 * limit:.2g} µm; late setpoints or a shock)"
    )


def _drop_segment_ends(disturbed: BoolArray, cycles: Cycles) -> BoolArray:
    """Return the disturbed cycles (cycles,) without those that only contain the start or end of the stroke.

    The first and the last cycle of a segment stay if a cycle between them is disturbed. They also stay if the
    disturbance continues from the segment before, or into the next one.
    """
    kept = disturbed.copy()
    for number in np.unique(cycles.segment[disturbed]):
        members = np.flatnonzero(cycles.segment == number)
        kept[members] &= disturbed[members[1:-1]].any()
    continues = np.convolve(kept, [1, 0, 1], "same") > 0
    return np.asarray(kept | (disturbed & continues))


def _mask_cycles(pieces: Sequence[Piece], cycles: Cycles, disturbed: BoolArray) -> tuple[Piece, ...]:
    excluded = np.where(cycles.cycle >= 0, disturbed[cycles.cycle], False)
    parts = split_by_piece(excluded, pieces)
    return tuple(replace(p, train=np.where(m, 0.0, p.train)) for p, m in zip(pieces, parts, strict=True))


def measure_disturbance(pieces: Sequence[Piece], cycles: Cycles) -> Array:
    """Return each cycle's jerk [m] against the median of its segment, (cycles,); NaN where nothing repeats."""
    x = np.concatenate([p.excitation.displacement for p in pieces])
    jerks = np.full(cycles.count, np.nan)
    segment = np.where(cycles.cycle >= 0, cycles.segment[cycles.cycle], -1)
    for number, condition in enumerate(cycles.conditions):
        samples = np.flatnonzero(segment == number)
        if condition.frequency and len(samples) > 4 * _HARMONICS:
            # The phase counts from the first sample, so that no bin of one cycle reaches into the next.
            phase = (cycles.phase[samples] - cycles.phase[samples[0]] + _PHASE_ROUNDING) % 1.0
            numbers, sizes = _measure_jerks(x[samples], cycles.cycle[samples], phase)
            jerks[numbers] = sizes
    return jerks


def _measure_jerks(x: Array, cycle: Indices, phase: Array) -> tuple[Indices, Array]:
    """Return the numbers of a segment's cycles and their jerks against the median cycle [m]."""
    numbers, index = np.unique(cycle, return_inverse=True)
    if len(numbers) < 3:
        return numbers, np.full(len(numbers), np.nan)
    deviation, grid = x - _fit_common_motion(x, phase), (np.arange(_PHASE_BINS) + 0.5) / _PHASE_BINS
    table = np.stack([np.interp(grid, phase[index == k], deviation[index == k]) for k in range(len(numbers))])
    # A soft start deviates as well, but smoothly: third differences reduce it to a five-hundredth.
    jerks = np.diff(table, 3, axis=1)
    return numbers, np.sqrt(np.mean((jerks - np.median(jerks, axis=0)) ** 2, axis=1))


def _fit_common_motion(x: Array, phase: Array) -> Array:
    """Fit the harmonics (n,) [m] that all cycles have in common; the frequency may differ from the planned one."""
    turn = 2.0 * np.pi * np.outer(np.arange(1, _HARMONICS + 1), phase)
    time = np.linspace(-1.0, 1.0, len(x))
    waves = np.vstack([np.cos(turn), np.sin(turn)])
    basis = np.vstack([np.ones(len(x)), time, waves, waves[[0, _HARMONICS]] * time])
    return np.asarray(np.linalg.lstsq(basis @ basis.T, basis @ x, rcond=1e-10)[0] @ basis)
