"""Noise that is not white: what of a residual repeats with the stroke, and whether the rest is noise at all.

Slow noise of a load cell lies above the high-frequency floor and below what cycles repeat. It may be taken for
noise only where nothing in it says otherwise: it has to be as strong at every time (bursts and sticking are not),
without lines (beats and hum are) and without a slow part of its own (drift is). Its strength over time is
compared with that of surrogates of the same spectrum and random phases (Theiler et al. 1992).
"""

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.gap.residual import Cycles
from identification.gap.where import Left

_MOST_BINS = 64
_SAMPLES_IN_BIN = 4
_FEWEST_CYCLES = 3
_STEADY_DRIVE = 0.02
"""[1] of the drive's range that a drive may vary by in a segment whose cycles are compared."""
_BLOCK = 0.025
"""[s] over which a residual is averaged: white noise is small in the means, coloured noise is not."""
_WINDOW = 1.0
"""[s] in which the strength of the noise is looked at."""
_SURROGATES = 60
_UNEVEN = 1.3
"""[1] times the most uneven surrogate up to which a noise counts as steady."""
_LINE = 30.0
"""[1] power of a line over the median around it: of a thousand frequencies the strongest has 12 by chance."""
_AROUND = 50
"""[frequencies] on each side of a line."""
_SLOW, _SWIFTER = 0.2, 1.2
"""[Hz] below the first lies drift; noise has as much between the two."""
_DRIFTS = 3.0
"""[1] ratio of the two powers from which on it is drift."""


def floor_under(left: Left, cycles: Cycles) -> float | None:
    """The noise [N] of a residual, all of it that does not repeat; None where that is no steady noise.

    Args:
        left: of a model.
        cycles: of the same samples.
    """
    repeats, total = _repeating(left, cycles)
    if total <= 0.0 or not steady(left):
        return None
    whole = float(np.mean(left.residual[left.valid] ** 2))
    return float(np.sqrt(whole * max(1.0 - repeats / total, 0.0)))


def _repeating(left: Left, cycles: Cycles) -> tuple[float, float]:
    """Sum of squares [N²] that repeats from cycle to cycle, and all of it, where that can be told."""
    repeats = total = 0.0
    span = max(float(np.ptp(left.drive)), 1e-12)
    inside = left.valid & (cycles.cycle >= 0)
    owner = np.where(inside, cycles.segment[cycles.cycle], -1)
    for number, condition in enumerate(cycles.conditions):
        mine = np.flatnonzero(owner == number)
        if not condition.frequency or not len(mine) or np.ptp(left.drive[mine]) > _STEADY_DRIVE * span:
            continue
        table = _by_cycle_and_phase(left.residual[mine], cycles.cycle[mine], cycles.phase[mine])
        if table is None:
            continue
        mean, spread = table.mean(axis=0), table.var(axis=0, ddof=1)
        repeats += len(mine) * max(float(np.mean(mean**2 - spread / len(table))), 0.0)
        total += float(np.sum(left.residual[mine] ** 2))
    return repeats, total


def _by_cycle_and_phase(residual: Array, cycle: npt.NDArray[np.intp], phase: Array) -> Array | None:
    """(cycles, bins) means of a residual; None with too few cycles."""
    names, place = np.unique(cycle, return_inverse=True)
    bins = min(_MOST_BINS, len(residual) // (len(names) * _SAMPLES_IN_BIN))
    if len(names) < _FEWEST_CYCLES or bins < 4:
        return None
    index = place * bins + np.minimum((phase * bins).astype(int), bins - 1)
    counts = np.bincount(index, minlength=len(names) * bins)
    table = (np.bincount(index, residual, len(counts)) / np.maximum(counts, 1)).reshape(len(names), bins)
    full = (counts.reshape(table.shape) > 0).all(axis=1)
    return table[full] if np.count_nonzero(full) >= _FEWEST_CYCLES else None


def steady(left: Left) -> bool:
    """Whether a residual is noise that is the same at all times, of whatever colour."""
    counts = [count for count, _ in left.rates]
    edges = np.cumsum([0, *counts])
    longest = counts.index(max(counts))
    part, rate = slice(edges[longest], edges[longest + 1]), left.rates[longest][1]
    means = _block_means(left.residual[part], left.valid[part], max(1, round(_BLOCK * rate)))
    if len(means) < 8 * round(_WINDOW / _BLOCK):
        return False
    return not _drifts(means) and not _has_line(means) and _as_strong_everywhere(means)


def _block_means(residual: Array, valid: BoolArray, length: int) -> Array:
    """Means over blocks; blocks that were not measured are left out."""
    count = len(residual) // length
    values = np.where(valid, residual, np.nan)[: count * length].reshape(count, length)
    means = np.nanmean(values[np.isfinite(values).any(axis=1)], axis=1)
    return np.asarray(means - means.mean())


def _power(means: Array) -> tuple[Array, Array]:
    """Frequencies [Hz] and power of block means, without the mean."""
    frequency = np.arange(1, len(means) // 2 + 1) / (_BLOCK * len(means))
    return frequency, np.asarray(np.abs(np.fft.rfft(means))[1:] ** 2, float)


def _drifts(means: Array) -> bool:
    frequency, power = _power(means)
    slow, swifter = frequency < _SLOW, (frequency >= _SLOW) & (frequency < _SWIFTER)
    return float(power[slow].mean()) > _DRIFTS * float(power[swifter].mean())


def _has_line(means: Array) -> bool:
    _, power = _power(means)
    padded = np.pad(power, _AROUND, mode="reflect")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * _AROUND + 1), axis=1)
    return bool(np.any(power > _LINE * around))


def _as_strong_everywhere(means: Array) -> bool:
    """Whether the strength varies no more from window to window than that of surrogates does."""
    chance = np.random.default_rng(0)
    size = np.abs(np.fft.rfft(means))
    turns = chance.uniform(0.0, 2.0 * np.pi, (_SURROGATES, len(size)))
    others = np.fft.irfft(size * np.exp(1j * turns), len(means), axis=1)
    return bool(_unevenness(means[None, :])[0] <= _UNEVEN * _unevenness(others).max())


def _unevenness(rows: Array) -> Array:
    """Relative spread of the power in windows, (rows,)."""
    length = round(_WINDOW / _BLOCK)
    count = rows.shape[1] // length
    power = np.mean(rows[:, : count * length].reshape(len(rows), count, length) ** 2, axis=2)
    return np.asarray(power.std(axis=1) / power.mean(axis=1))
