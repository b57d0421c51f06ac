"""What is kept out of every fit, and how far the gap shrinks there."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.gap.residual import Cycles

Indices = npt.NDArray[np.intp]

_EVERY = 4
"""One segment, or cycle, of so many is held out."""
_FEWEST_SEGMENTS = 10
"""Segments below which cycles are held out rather than whole segments."""
_DRAWS = 1000
_FORM, _FEW_STROKES = 0.8, 0.4
"""[1] deviation of the logarithm of what a form leaves, from strokes to others; and more where strokes are few."""
_SIZE = 0.35
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
    """[N] RMSE with them, as it is to be expected of another run."""
    value: float | None
    """[1] none where there is no gap to shrink."""
    ci95: tuple[float, float] | None
    worth: float | None = None
    """[1] what is expected to be closed of the whole run's gap, were this very run made again."""


class Judged(NamedTuple):
    """The cycles of a recording, fitted or kept out, (cycles,) each."""

    before: Array
    """Sum of squared residuals without effects [N²]."""
    after: Array
    """The same with them."""
    counts: Array
    """Samples."""
    segment: Indices
    """Which segment each belongs to."""
    held: BoolArray
    """True where it was kept out of every fit."""

    def means(self) -> tuple[float, float]:
        """Mean squares [N²] without and with effects on the cycles kept out."""
        total = float(self.counts[self.held].sum())
        return float(self.before[self.held].sum()) / total, float(self.after[self.held].sum()) / total


class Again(NamedTuple):
    """The strokes played once more, with the noise of the motion drawn anew and nothing else changed."""

    cycles: float
    """Mean squared change of the simulated force [N²] on all cycles that are judged."""
    held: float
    """The same on those kept out."""
    runs: Array
    """(runs,) the same over everything that was recorded, first instants and ends as well."""
    before: float
    """Mean squared residual without effects [N²] over everything that was recorded."""


def shrinkage(judged: Judged, noise: float, again: Again, strokes: int) -> Shrinkage:
    """How far the gap shrinks on another run of the same damper: its expectation, with an interval.

    Two things are left there. The error of the form is that of all cycles beyond both noises, fitted ones too: a
    fit of two dozen numbers hides next to nothing of a form's error on the strokes that it saw, and the few kept
    out are a small sample. Their conditions are drawn anew, and their cycles, it is never below zero, and it is
    another one on other strokes, the more so the fewer strokes the recording has. Many strokes are a sample, and
    their mean is what others leave on average, however widely these differ; few are none, and others leave more.
    The motion of another run carries its own noise into the force, most where it is known from one side only; no
    fit looks at these instants, but every run has them.

    Args:
        judged: the cycles.
        noise: of the recorded force [N].
        again: the strokes played once more with the effects.
        strokes: how many of different amplitude or frequency were recorded.
    """
    before, after = judged.means()
    if before < (_NEAR_FLOOR * noise) ** 2:
        return Shrinkage(math.sqrt(before), math.sqrt(after), None, None)
    if judged.before is judged.after or np.array_equal(judged.before, judged.after):
        return Shrinkage(math.sqrt(before), math.sqrt(after), 0.0, (0.0, 0.0))
    lost = _lost(judged, noise, again, strokes)
    value = 1.0 - float(lost.mean())
    low, high = np.quantile(1.0 - lost, [0.025, 0.975])
    expected = math.sqrt(noise**2 + (1.0 - value) * (before - noise**2))
    interval = (min(float(low), value), max(float(high), value))
    return Shrinkage(math.sqrt(before), expected, value, interval, _worth(after, noise, again))


def _worth(after: float, noise: float, again: Again) -> float:
    """Part [1] of the whole run's gap that a set is expected to close where the run is made again.

    ``after`` [N²] is of the cycles kept out: whoever fits too much does harm there.
    """
    left = max(after - noise**2 - again.held, 0.0) + float(again.runs.mean())
    return 1.0 - left / max(again.before - noise**2, 1e-2 * noise**2)


def _lost(judged: Judged, noise: float, again: Again, strokes: int) -> Array:
    """(draws,) parts of the gap [1] that other runs would leave."""
    random = np.random.default_rng(0)
    before, after = _drawn(judged, random)
    gap = np.maximum(before - noise**2, 1e-2 * noise**2)
    form = np.maximum(after - noise**2 - again.cycles, 0.0) / gap
    spread = _FORM + _FEW_STROKES / max(strokes, 1)
    form *= np.exp(spread * random.standard_normal(_DRAWS) - 0.5 * _FORM**2)
    size = (again.before - noise**2) * np.exp(_SIZE * random.standard_normal(_DRAWS))
    motion = random.choice(again.runs, _DRAWS) / np.maximum(size, 1e-2 * noise**2)
    return np.asarray(form + motion)


def _drawn(judged: Judged, random: np.random.Generator) -> Array:
    """(2, draws) mean squares [N²] without and with effects: segments drawn anew, then cycles within each."""
    names, place = np.unique(judged.segment, return_inverse=True)
    members = [np.flatnonzero(place == k) for k in range(len(names))]
    sums, means = np.stack(judged[:2]), np.empty((2, _DRAWS))
    for draw in range(_DRAWS):
        chosen = random.integers(0, len(names), len(names))
        rows = np.concatenate([random.choice(members[k], len(members[k])) for k in chosen])
        means[:, draw] = sums[:, rows].sum(axis=1) / judged.counts[rows].sum()
    return means
