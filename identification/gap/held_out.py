"""What is kept out of every fit, and how far the gap shrinks there."""

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.gap.residual import Cycles

Indices = npt.NDArray[np.intp]
Drawn = TypeVar("Drawn", float, Array)

_EVERY = 4
"""One segment, or cycle, of so many is held out."""
_FEWEST_SEGMENTS = 10
"""Segments below which cycles are held out rather than whole segments."""
_DRAWS = 1000
_FORM, _FEW_STROKES = 0.35, 1.0
"""[1] deviation of the logarithm of what a form leaves, from strokes to others; and more where strokes are few."""
_SIZE = 0.25
"""[1] deviation of the logarithm of the gap itself."""
_NEAR_FLOOR = 1.02
"""[1] RMSE over the floor below which there is no gap to shrink."""


def held_out_cycles(cycles: Cycles) -> BoolArray:
    """(cycles,) True where a cycle is kept out of every fit: each fourth segment, or each fourth cycle of few.

    Whole segments are conditions that no fit saw, next to others that it did; with few of them only time is left.
    Cycles are taken from another place in every segment, so that there is one that follows a step of the drive.
    """
    if len(cycles.conditions) >= _FEWEST_SEGMENTS:
        return np.asarray(cycles.segment % _EVERY == _EVERY // 2)
    held = np.zeros(cycles.count, bool)
    for place, segment in enumerate(np.unique(cycles.segment), _EVERY // 2):
        mine = np.flatnonzero(cycles.segment == segment)
        held[mine[place % _EVERY :: _EVERY]] = True
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


class Start(NamedTuple):
    """The first instants of the recordings, before the damper has moved: no fit sees them."""

    share: float = 0.0
    """[1] of all samples."""
    before: float = 0.0
    """Mean squared residual there without effects [N²]."""
    after: float = 0.0
    """The same with them."""


class HeldOut(NamedTuple):
    """The held-out cycles, (cycles,) each, and how the recordings begin."""

    before: Array
    """Sum of squared residuals without effects [N²]."""
    after: Array
    """The same with them."""
    counts: Array
    """Samples."""
    segment: Indices
    """Which segment each belongs to."""
    start: Start = Start()


def shrinkage(held: HeldOut, noise: float, carried: float, strokes: int) -> Shrinkage:
    """How far the gap shrinks, with an interval for other strokes of the same damper.

    Conditions that were held out are drawn anew, and their cycles. Two things are no matter of drawing: the motion
    of another run carries its noise into the force again, and the error of a form is another one on other strokes,
    the more so the fewer strokes the recording has. Every run begins, too, with a hysteresis that nobody knows and
    a motion that is known from one side only: that counts with the share that it has in the recording.

    Args:
        held: the held-out cycles.
        noise: of the recorded force [N].
        carried: noise of the motion in the simulated force [N].
        strokes: how many of different amplitude or frequency were recorded.
    """
    total, start = float(held.counts.sum()), held.start
    squares = [float(s.sum()) / total for s in held[:2]]
    rms = [float(np.sqrt(_begun(s, start.share, own))) for s, own in zip(squares, start[1:], strict=True)]
    if rms[0] < _NEAR_FLOOR * noise:
        return Shrinkage(rms[0], rms[1], None, None)
    value = 1.0 - (rms[1] ** 2 - noise**2) / (rms[0] ** 2 - noise**2)
    if held.before is held.after or np.array_equal(held.before, held.after):
        return Shrinkage(rms[0], rms[1], value, (value, value))
    random = np.random.default_rng(0)
    drawn = _drawn(held, random)
    before, after = (_begun(s, start.share, own) for s, own in zip(drawn, start[1:], strict=True))
    spread = _FORM + _FEW_STROKES / max(strokes, 1)
    left = np.maximum(after - noise**2, 0.0) * np.exp(spread * random.standard_normal(_DRAWS))
    left += carried**2 * np.exp(_FORM * random.standard_normal(_DRAWS))
    whole = np.maximum(before - noise**2, 1e-2 * noise**2) * np.exp(_SIZE * random.standard_normal(_DRAWS))
    low, high = np.quantile(1.0 - left / whole, [0.025, 0.975])
    return Shrinkage(rms[0], rms[1], value, (min(float(low), value), max(float(high), value)))


def _begun(square: Drawn, share: float, start: float) -> Drawn:
    """Mean square [N²] of strokes together with how they begin."""
    return (1.0 - share) * square + share * start


def _drawn(held: HeldOut, random: np.random.Generator) -> tuple[Array, Array]:
    """Mean squares (draws,) [N²] without and with effects: segments drawn anew, then cycles within each."""
    names, place = np.unique(held.segment, return_inverse=True)
    members = [np.flatnonzero(place == k) for k in range(len(names))]
    means = np.empty((2, _DRAWS))
    for draw in range(_DRAWS):
        chosen = random.integers(0, len(names), len(names))
        rows = np.concatenate([random.choice(members[k], len(members[k])) for k in chosen])
        means[:, draw] = np.array([held.before[rows].sum(), held.after[rows].sum()]) / held.counts[rows].sum()
    return means[0], means[1]
