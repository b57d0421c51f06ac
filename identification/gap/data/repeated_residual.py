"""Part of a residual that repeats from cycle to cycle.

Noise of any spectrum differs between two cycles of one stroke. What their residuals have in common is an error of
the model. It can be far smaller than the uncertainty of a floor with slow noise and still be certain.
"""

import numpy as np

from identification.arrays import Array
from identification.gap.data.cycles import Cycles
from identification.gap.data.error_square import ErrorSquare
from identification.gap.data.residual_map import Residual

_PHASE_BINS = 32
"""Parts of a cycle in which the residuals of two cycles are compared."""
_FEWEST_CYCLES = 4
"""Smallest number of cycles of a segment."""


def estimate_repeated_residual(residual: Residual, cycles: Cycles) -> ErrorSquare | None:
    """Estimate the part of a residual that repeats from cycle to cycle; None if no segment has enough cycles.

    Cycles next to each other share slow noise, so only others are compared, each without its mean and slope.
    """
    segments = range(len(cycles.conditions))
    tables = [table for k in segments if (table := _make_table(residual, cycles, k)) is not None]
    if not tables:
        return None
    weights = np.array([len(table) for table in tables], float)
    weights /= weights.sum()
    found = np.array([_compare_cycles(table) for table in tables])
    return ErrorSquare(float(weights @ found[:, 0]), float(np.sqrt(weights**2 @ found[:, 1])))


def _make_table(residual: Residual, cycles: Cycles, segment: int) -> Array | None:
    """Return the residual (cycles, bins) [N] of whole cycles of a segment, without mean and slope of each."""
    if not cycles.conditions[segment].frequency:
        return None
    members = np.flatnonzero(cycles.segment == segment)
    if len(members) < _FEWEST_CYCLES:
        return None
    chosen = residual.valid & (cycles.cycle >= members[0]) & (cycles.cycle <= members[-1])
    bins = (cycles.phase[chosen] * _PHASE_BINS).astype(int) % _PHASE_BINS
    index = (cycles.cycle[chosen] - members[0]) * _PHASE_BINS + bins
    shape = len(members), _PHASE_BINS
    counts = np.bincount(index, minlength=shape[0] * shape[1]).reshape(shape)
    sums = np.bincount(index, residual.values[chosen], shape[0] * shape[1]).reshape(shape)
    whole = counts.min(axis=1) > 0
    if np.count_nonzero(whole) < _FEWEST_CYCLES:
        return None
    # A cycle begins anywhere in its stroke, so its slope counts from its first bin.
    first = int(np.argmax(cycles.cycle == members[0]))
    table = np.roll(sums[whole] / counts[whole], -int(cycles.phase[first] * _PHASE_BINS), axis=1)
    basis = np.stack([np.ones(_PHASE_BINS), np.linspace(-1.0, 1.0, _PHASE_BINS)])
    return np.asarray(table - np.linalg.lstsq(basis.T, table.T, rcond=None)[0].T @ basis)


def _compare_cycles(table: Array) -> tuple[float, float]:
    """Return the mean product of cycles that are not neighbours [N²], and its variance from noise alone [N⁴]."""
    count = len(table)
    apart = np.triu(np.ones((count, count), bool), 2)
    products = table @ table.T / _PHASE_BINS
    noise = table - table.mean(axis=0)
    chance = (noise @ noise.T / _PHASE_BINS * count / (count - 1)) ** 2
    pairs = np.count_nonzero(apart)
    return float(products[apart].mean()), float(chance[apart].mean()) / pairs
