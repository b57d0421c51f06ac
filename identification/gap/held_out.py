"""What is kept out of every fit, and how far the gap shrinks there."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.gap.residual import Cycles

_EVERY = 4
"""One segment, or cycle, of so many is held out."""
_FEWEST_SEGMENTS = 10
"""Segments below which cycles are held out rather than whole segments."""
_DRAWS = 1000
_NEAR_FLOOR = 1.02
"""[1] RMSE over the floor below which there is no gap to shrink."""


def held_out_cycles(cycles: Cycles) -> BoolArray:
    """(cycles,) True where a cycle is kept out of every fit: each fourth segment, or each fourth cycle of few.

    Whole segments are conditions that no fit saw, next to others that it did; with few of them only time is left.
    """
    if len(cycles.conditions) >= _FEWEST_SEGMENTS:
        return np.asarray(cycles.segment % _EVERY == _EVERY // 2)
    held = np.zeros(cycles.count, bool)
    for segment in np.unique(cycles.segment):
        mine = np.flatnonzero(cycles.segment == segment)
        held[mine[_EVERY // 2 :: _EVERY]] = True
    if not held.any():
        held[1::_EVERY] = True
    return held


@dataclass(frozen=True)
class Shrinkage:
    """How far a model closes the gap on the held-out strokes."""

    before: float
    """[N] RMSE without effects."""
    after: float
    """[N] RMSE with them."""
    value: float | None
    """[1] none where there is no gap to shrink."""
    ci95: tuple[float, float] | None


def shrinkage(before: Array, after: Array, counts: Array, floor: float) -> Shrinkage:
    """How far the gap shrinks, with an interval from drawing the held-out cycles anew.

    Args:
        before: (cycles,) sum of squared residuals without effects [N²].
        after: (cycles,) the same with them.
        counts: (cycles,) samples.
        floor: noise of the force [N].
    """
    total = float(counts.sum())
    rms = [float(np.sqrt(s.sum() / total)) for s in (before, after)]
    if rms[0] < _NEAR_FLOOR * floor:
        return Shrinkage(rms[0], rms[1], None, None)
    draws = np.random.default_rng(0).integers(0, len(counts), (_DRAWS, len(counts)))
    samples = counts[draws].sum(axis=1)
    drawn = 1.0 - (after[draws].sum(axis=1) / samples - floor**2) / np.maximum(
        before[draws].sum(axis=1) / samples - floor**2, 1e-3 * floor**2
    )
    value = 1.0 - (rms[1] ** 2 - floor**2) / (rms[0] ** 2 - floor**2)
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Shrinkage(rms[0], rms[1], value, (min(float(low), value), max(float(high), value)))
