"""Mains line in the remainder of the force in the windows of a stretch: one frequency and one phase for all.

Mains interference is an effect that a diagnosis names (``mains_hum``), not noise. A line that is not coherent over
the whole stretch stays in the noise, because no model predicts it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.noise.window_fit import WindowFit

_RANGES = ((47.0, 52.0), (57.0, 62.0))
"""Ranges of the mains frequency [Hz]: of 50 Hz by EN 50160, and the same for 60 Hz."""
_HARMONICS = (1, 3)
"""Orders of the line's harmonics that the effect ``mains_hum`` has."""
_PADDING_FACTOR = 8
"""Factor by which zero padding refines the spectrum."""
_MIN_GAIN = 0.1
"""Smallest part of a line's power that the fits must leave [1]; elsewhere a line looks like the damper."""
_MIN_BINS = 20
"""Smallest number of frequency bins in the range; with fewer, a short oscillation looks like a line."""
_MIN_POWER_RATIO = 25.0
"""Smallest power of a line, relative to the median of the range; noise alone exceeds it once in 10⁷ ranges."""


class MainsLine(NamedTuple):
    """Mains interference of one stretch."""

    frequency: float
    """Frequency [Hz]."""
    deviation: float
    """Root mean square of the line [N]."""
    remainders: list[Array]
    """Remainder of each window's force without the line, (N,) [N]."""


def find_mains_line(fits: Sequence[WindowFit], remainders: Sequence[Array], rate: float) -> MainsLine | None:
    """Find the mains line that all windows of a stretch have in common; None if there is none.

    Args:
        fits: the windows' fits.
        remainders: what they leave of the force, (N,) each [N].
        rate: sampling rate [Hz].
    """
    frequency = _find_frequency(fits, remainders, rate)
    if frequency is None:
        return None
    orders = [k for k in _HARMONICS if _measure_gain(fits, np.full(1, k * frequency), rate)[0] > _MIN_GAIN]
    columns = [fit.remove(_make_waves(fit, [k * frequency / rate for k in orders])) for fit in fits]
    amplitudes = np.linalg.lstsq(np.vstack(columns), np.concatenate(remainders), rcond=1e-9)[0]
    cleaned = [r - c @ amplitudes for r, c in zip(remainders, columns, strict=True)]
    return MainsLine(frequency, float(np.sqrt(0.5 * amplitudes @ amplitudes)), cleaned)


def _find_frequency(fits: Sequence[WindowFit], remainders: Sequence[Array], rate: float) -> float | None:
    if rate < 2.0 * _RANGES[-1][1] or not fits:
        return None
    series = np.zeros(max(fit.window.stop for fit in fits))
    for fit, remainder in zip(fits, remainders, strict=True):
        series[fit.window.start : fit.window.stop] = remainder
    count = _PADDING_FACTOR * len(series)
    frequency = np.asarray(np.arange(count // 2 + 1) * (rate / count), float)
    near = np.any([(frequency > low) & (frequency < high) for low, high in _RANGES], axis=0)
    power, frequency = np.abs(np.fft.rfft(series, count)[near]) ** 2, frequency[near]
    gain = _measure_gain(fits, frequency, rate)
    visible = gain > _MIN_GAIN
    samples = sum(len(fit.window.force) for fit in fits)
    if np.count_nonzero(visible) / _PADDING_FACTOR * samples / len(series) < _MIN_BINS:
        return None
    explained = np.where(visible, power / np.maximum(gain, 1e-300), 0.0)
    strongest = int(np.argmax(explained))
    # The median of an exponential variable is 0.69 of its mean.
    if explained[strongest] < _MIN_POWER_RATIO * float(np.median(explained[visible])) / np.log(2.0):
        return None
    # The fit of a window removes a line near a harmonic of the stroke, and leaves what leaks beside it.
    leakage, resolution = rate / min(len(fit.window.force) for fit in fits), rate / len(series)
    centre = float(frequency[strongest])
    for reach, step in ((leakage, 0.5 * resolution), (resolution, resolution / _PADDING_FACTOR)):
        grid = centre + np.arange(-reach, reach, step)
        grid = np.append(grid[_measure_gain(fits, grid, rate) > _MIN_GAIN], centre)
        centre = float(grid[np.argmax([_measure_explained(fits, remainders, f / rate) for f in grid])])
    return centre


def _measure_explained(fits: Sequence[WindowFit], remainders: Sequence[Array], step: float) -> float:
    """Return the sum of squares [N²] that a line explains; its frequency is in cycles a sample."""
    columns = np.vstack([fit.remove(_make_waves(fit, [step])) for fit in fits])
    values = np.concatenate(remainders)
    return float(values @ columns @ np.linalg.lstsq(columns, values, rcond=1e-9)[0])


def _measure_gain(fits: Sequence[WindowFit], frequency: Array, rate: float) -> Array:
    """Return the part (F,) of the power of a line at these frequencies [Hz] that the fits leave."""
    counts = np.array([len(fit.window.force) for fit in fits], float)
    gains = [
        np.interp(frequency, np.arange(len(fit.gain)) * (rate / count), fit.gain, right=0.0)
        for fit, count in zip(fits, counts, strict=True)
    ]
    return np.asarray(counts @ gains / counts.sum())


def _make_waves(fit: WindowFit, steps: Sequence[float]) -> Array:
    """Return (N, 2 orders) cosine and sine in the stretch's time; the steps are in cycles a sample."""
    angle = 2.0 * np.pi * np.arange(fit.window.start, fit.window.stop)
    return np.column_stack([wave(step * angle) for step in steps for wave in (np.cos, np.sin)])
