"""Coloured noise: the part of a residual that is stationary and does not repeat with the stroke.

Slow noise of a load cell lies above the high-frequency noise floor, and cycles do not repeat it. A residual counts
as noise only if it is stationary. Its power must be the same at all times, which excludes bursts and sticking. It
must have no line, which excludes beats and mains interference, and no drift. The variation of its power is
compared with that of surrogates of the same spectrum with random phases (Theiler et al. 1992).
"""

import numpy as np

from identification.arrays import Array, BoolArray
from identification.gap.data import Cycles, Indices, Residual

_MAX_BINS = 64
"""Largest number of phase bins in a cycle."""
_SAMPLES_IN_BIN = 4
"""Smallest average number of samples in a phase bin."""
_FEWEST_BINS = 4
"""Smallest number of phase bins with which cycles are compared."""
_FEWEST_CYCLES = 3
"""Smallest number of cycles in a segment with which they are compared."""
_STEADY_DRIVE = 0.02
"""Largest variation of the drive in a compared segment, relative to the drive's range."""
_AVERAGING_TIME = 0.025
"""Time over which a residual is averaged [s]: it makes white noise small, but not coloured noise."""
_WINDOW = 1.0
"""Length of the windows whose power is compared [s]."""
_FEWEST_WINDOWS = 8
"""Smallest number of windows with which stationarity is tested."""
_SURROGATES = 60
"""Surrogates with which the variation of the power is compared."""
_POWER_VARIATION_LIMIT = 1.3
"""Largest variation of the power of stationary noise, relative to that of the most uneven surrogate."""
_LINE_POWER_RATIO = 30.0
"""Smallest power of a line, relative to the median around it; the strongest of a thousand has 12 by chance."""
_LINE_NEIGHBOURHOOD = 50
"""Width of a line's neighbourhood to each side [frequency bins]."""
_DRIFT_BAND = 0.2
"""Highest frequency of drift [Hz]."""
_REFERENCE_BAND = 1.2
"""Highest frequency of the band with which drift is compared [Hz]."""
_DRIFT_POWER_RATIO = 3.0
"""Smallest power of drift, relative to that of the reference band."""


def estimate_coloured_floor(residual: Residual, cycles: Cycles) -> float | None:
    """Estimate the noise [N] as the part of a residual that does not repeat; None if the residual is not noise.

    Args:
        residual: residual of a model.
        cycles: cycles of the same samples.
    """
    repeating, total = _sum_repeating_power(residual, cycles)
    if total <= 0.0 or not is_stationary(residual):
        return None
    power = float(np.mean(residual.values[residual.valid] ** 2))
    return float(np.sqrt(power * max(1.0 - repeating / total, 0.0)))


def _sum_repeating_power(residual: Residual, cycles: Cycles) -> tuple[float, float]:
    """Return the sums of squares [N²] that repeat from cycle to cycle, and in total, over comparable segments."""
    repeating = total = 0.0
    drive_range = max(float(np.ptp(residual.drive)), 1e-12)
    chosen = residual.valid & (cycles.cycle >= 0)
    segment = np.where(chosen, cycles.segment[cycles.cycle], -1)
    for number, condition in enumerate(cycles.conditions):
        rows = np.flatnonzero(segment == number)
        # Where the drive varies, the force changes from cycle to cycle without any noise.
        if not condition.frequency or not len(rows) or np.ptp(residual.drive[rows]) > _STEADY_DRIVE * drive_range:
            continue
        table = _bin_by_phase(residual.values[rows], cycles.cycle[rows], cycles.phase[rows])
        if table is None:
            continue
        mean, variance = table.mean(axis=0), table.var(axis=0, ddof=1)
        # The mean over the cycles still contains a share of their noise.
        repeating += len(rows) * max(float(np.mean(mean**2 - variance / len(table))), 0.0)
        total += float(np.sum(residual.values[rows] ** 2))
    return repeating, total


def _bin_by_phase(values: Array, cycle: Indices, phase: Array) -> Array | None:
    """Average a residual in phase bins of each cycle, (cycles, bins); None with too few cycles or samples."""
    numbers, index = np.unique(cycle, return_inverse=True)
    bins = min(_MAX_BINS, len(values) // (len(numbers) * _SAMPLES_IN_BIN))
    if len(numbers) < _FEWEST_CYCLES or bins < _FEWEST_BINS:
        return None
    cell = index * bins + np.minimum((phase * bins).astype(int), bins - 1)
    counts = np.bincount(cell, minlength=len(numbers) * bins)
    table = (np.bincount(cell, values, len(counts)) / np.maximum(counts, 1)).reshape(len(numbers), bins)
    complete = (counts.reshape(table.shape) > 0).all(axis=1)
    return table[complete] if np.count_nonzero(complete) >= _FEWEST_CYCLES else None


def is_stationary(residual: Residual) -> bool:
    """Return True if the residual of the longest stretch is stationary noise of any spectrum."""
    counts = [count for count, _ in residual.rates]
    edges = np.cumsum([0, *counts])
    longest = counts.index(max(counts))
    part, rate = slice(edges[longest], edges[longest + 1]), residual.rates[longest][1]
    length = max(1, round(_AVERAGING_TIME * rate))
    means = _average_residual(residual.values[part], residual.valid[part], length)
    if len(means) < _FEWEST_WINDOWS * round(_WINDOW / _AVERAGING_TIME):
        return False
    return not _has_drift(means) and not _has_line(means) and _has_constant_power(means)


def _average_residual(values: Array, valid: BoolArray, length: int) -> Array:
    """Average over so many samples each and subtract the mean; averages without any valid sample are omitted."""
    count = len(values) // length
    table = np.where(valid, values, np.nan)[: count * length].reshape(count, length)
    means = np.nanmean(table[np.isfinite(table).any(axis=1)], axis=1)
    return np.asarray(means - means.mean())


def _compute_spectrum(means: Array) -> tuple[Array, Array]:
    """Return frequencies [Hz] and power of averages, without the constant part."""
    frequency = np.arange(1, len(means) // 2 + 1) / (_AVERAGING_TIME * len(means))
    return frequency, np.asarray(np.abs(np.fft.rfft(means))[1:] ** 2, float)


def _has_drift(means: Array) -> bool:
    frequency, power = _compute_spectrum(means)
    drift, reference = frequency < _DRIFT_BAND, (frequency >= _DRIFT_BAND) & (frequency < _REFERENCE_BAND)
    return float(power[drift].mean()) > _DRIFT_POWER_RATIO * float(power[reference].mean())


def _has_line(means: Array) -> bool:
    _, power = _compute_spectrum(means)
    padded = np.pad(power, _LINE_NEIGHBOURHOOD, mode="reflect")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * _LINE_NEIGHBOURHOOD + 1), axis=1)
    return bool(np.any(power > _LINE_POWER_RATIO * around))


def _has_constant_power(means: Array) -> bool:
    """Return True if the power varies from window to window no more than that of surrogates."""
    # A fixed seed, because the verdict on a recording must not depend on chance.
    random = np.random.default_rng(0)
    size = np.abs(np.fft.rfft(means))
    phases = random.uniform(0.0, 2.0 * np.pi, (_SURROGATES, len(size)))
    surrogates = np.fft.irfft(size * np.exp(1j * phases), len(means), axis=1)
    variation = _compute_power_variation(means[None, :])[0]
    return bool(variation <= _POWER_VARIATION_LIMIT * _compute_power_variation(surrogates).max())


def _compute_power_variation(rows: Array) -> Array:
    """Return the relative standard deviation of the power of windows, (rows,)."""
    length = round(_WINDOW / _AVERAGING_TIME)
    count = rows.shape[1] // length
    power = np.mean(rows[:, : count * length].reshape(len(rows), count, length) ** 2, axis=2)
    return np.asarray(power.std(axis=1) / power.mean(axis=1))
