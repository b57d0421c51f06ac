"""Residual of the refitted law by stroke condition, phase, harmonic and time.

The gap of a part of the recording is the mean square of its residual beyond the variance of the noise floor.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.documents import Drift, GapMapEntry, ResidualHarmonic
from identification.gap.data.cycles import Cycles, Indices, StrokeCondition
from identification.noise import WhiteningFilter

_PHASE_BINS = 8
"""Parts of a cycle in the gap map."""
_MAX_MAP_ENTRIES = 400
"""Largest number of entries in the gap map."""
_HARMONIC_COUNT = 9
"""Harmonics of the stroke that are reported."""
_LOWEST_LINE_FREQUENCY = 40.0
"""Lowest frequency of a spectral line [Hz]; below it, a line could belong to the stroke."""
_LINE_POWER_RATIO = 40.0
"""Smallest power of a spectral line, relative to the median of its neighbourhood."""
_LINE_PEAK_RATIO = 10.0
"""Smallest power of a spectral line, relative to the largest other power in its neighbourhood."""
_LINE_WIDTH = 3
"""Width of a spectral line to each side [frequency bins]."""
_LINE_NEIGHBOURHOOD = 200
"""Width of a line's neighbourhood to each side [frequency bins]."""


@dataclass(frozen=True)
class Residual:
    """Residual of a model; N counts the samples of all stretches in sequence."""

    values: Array
    """(N,) recorded less simulated force [N]."""
    simulated_force: Array
    """(N,) [N]"""
    drive: Array
    """(N,) [V or A]"""
    time: Array
    """(N,) time since the first sample [s]."""
    valid: BoolArray
    """(N,) False where a sample was not measured or precedes the first motion of its stretch."""
    rates: tuple[tuple[int, float], ...]
    """Number of samples and rate [Hz] of each stretch."""

    @property
    def parts(self) -> Iterator[tuple[slice, float]]:
        """Samples and rate [Hz] of each stretch."""
        start = 0
        for count, rate in self.rates:
            yield slice(start, start + count), rate
            start += count

    def whiten(self, whitening: WhiteningFilter) -> "Residual":
        """Return the residual behind a filter; samples that are not valid count as zero before it."""
        if len(whitening.taps) == 1:
            return self
        known = np.where(self.valid, self.values, 0.0)
        return replace(self, values=np.concatenate([whitening.apply(known[part]) for part, _ in self.parts]))


def map_gap(residual: Residual, cycles: Cycles, floor: float) -> list[GapMapEntry]:
    """Return the gap by drive, amplitude, frequency and phase, the largest first.

    Args:
        residual: residual of the refitted law.
        cycles: cycles of the same samples.
        floor: noise of the force [N].
    """
    names = sorted({_round_condition(c) for c in cycles.conditions})
    rows = {name: k for k, name in enumerate(names)}
    row_of_segment = np.array([rows[_round_condition(c)] for c in cycles.conditions])[cycles.segment]
    chosen = residual.valid & (cycles.cycle >= 0)
    bins = (cycles.phase[chosen] * _PHASE_BINS).astype(int) % _PHASE_BINS
    index = row_of_segment[cycles.cycle[chosen]] * _PHASE_BINS + bins
    squares = np.bincount(index, residual.values[chosen] ** 2, len(names) * _PHASE_BINS)
    counts = np.bincount(index, minlength=len(names) * _PHASE_BINS)
    gaps = np.sqrt(np.maximum(squares / np.maximum(counts, 1) - floor**2, 0.0))
    entries = [
        GapMapEntry(
            drive=name[0],
            amplitude_m=name[1],
            frequency_hz=name[2],
            phase=(k + 0.5) / _PHASE_BINS if name[2] else 0.0,
            gap_n=float(gaps[i * _PHASE_BINS + k]),
        )
        for i, name in enumerate(names)
        for k in range(_PHASE_BINS)
        if counts[i * _PHASE_BINS + k]
    ]
    return sorted(entries, key=lambda entry: -entry.gap_n)[:_MAX_MAP_ENTRIES]


def _round_condition(condition: StrokeCondition) -> tuple[float, float, float]:
    """Round drive, amplitude and frequency, so that repeated strokes fall into one row of the map."""
    return (
        float(f"{condition.drive:.3g}"),
        float(f"{condition.amplitude:.2g}"),
        float(f"{condition.frequency:.3g}"),
    )


def compute_harmonics(residual: Residual, cycles: Cycles) -> list[ResidualHarmonic]:
    """Return the harmonics of the stroke in the residual, over all periodic strokes; empty if none is periodic."""
    power = np.zeros(_HARMONIC_COUNT)
    periodic = np.array([c.frequency > 0 for c in cycles.conditions])[cycles.segment]
    chosen = residual.valid & (cycles.cycle >= 0)
    chosen[chosen] = periodic[cycles.cycle[chosen]]
    segment = cycles.segment[cycles.cycle[chosen]]
    values, phase = residual.values[chosen], cycles.phase[chosen]
    counts = np.bincount(segment, minlength=len(cycles.conditions))
    samples = int(counts.sum())
    if not samples:
        return []
    for order in range(1, _HARMONIC_COUNT + 1):
        wave = np.exp(-2j * np.pi * order * phase)
        sums = np.bincount(segment, (values * wave).real, len(counts)) ** 2
        sums += np.bincount(segment, (values * wave).imag, len(counts)) ** 2
        power[order - 1] = float(np.sum(2.0 * sums / np.maximum(counts, 1)))
    return [ResidualHarmonic(order=k + 1, rms_n=float(np.sqrt(p / samples))) for k, p in enumerate(power)]


def estimate_drift(residual: Residual, cycles: Cycles) -> Drift:
    """Estimate the drift of the residual's mean and of the force's size, and the strongest free spectral line."""
    chosen = residual.valid & (cycles.cycle >= 0)
    segment = cycles.segment[cycles.cycle[chosen]]
    counts = np.bincount(segment, minlength=len(cycles.conditions)).astype(float)
    used = counts > 0
    means = np.bincount(segment, residual.values[chosen], len(counts))[used] / counts[used]
    times = np.bincount(segment, residual.time[chosen], len(counts))[used] / counts[used]
    sizes = _estimate_force_ratios(residual, chosen, segment, len(counts))[used]
    frequency, amplitude = find_strongest_line(residual)
    return Drift(
        slope_n_per_s=_fit_slope(times, means, counts[used]),
        mean_rms_n=_compute_spread(means, counts[used]),
        size_change=_fit_slope(times, sizes, counts[used]) * float(np.ptp(residual.time)),
        line_hz=frequency,
        line_n=amplitude,
    )


def _compute_spread(values: Array, weights: Array) -> float:
    """Compute the weighted standard deviation."""
    mean = np.average(values, weights=weights)
    return float(np.sqrt(np.average((values - mean) ** 2, weights=weights)))


def _estimate_force_ratios(residual: Residual, chosen: BoolArray, segment: Indices, count: int) -> Array:
    """Estimate the ratio of recorded to simulated force in each segment, (segments,)."""
    simulated, values = residual.simulated_force[chosen], residual.values[chosen]
    products = np.bincount(segment, values * simulated, count)
    squares = np.bincount(segment, simulated**2, count)
    return np.asarray(1.0 + products / np.maximum(squares, 1e-12))


def _fit_slope(times: Array, values: Array, weights: Array) -> float:
    """Fit the weighted slope of values over time; 0 if there is only one time."""
    if len(times) < 2:
        return 0.0
    t = times - np.average(times, weights=weights)
    return float(np.sum(weights * t * values) / max(np.sum(weights * t * t), 1e-12))


def find_strongest_line(residual: Residual) -> tuple[float | None, float]:
    """Return frequency [Hz] and amplitude [N] of the strongest line of any stretch; (None, 0) without one."""
    lines = (_find_line(residual.values[part], rate) for part, rate in residual.parts)
    return max(lines, key=lambda frequency_and_amplitude: frequency_and_amplitude[1], default=(None, 0.0))


def _find_line(values: Array, rate: float) -> tuple[float | None, float]:
    """Find the strongest line of one stretch.

    The spectrum of a whole stretch resolves a line more sharply than any harmonic, which lasts one segment only.
    """
    window = np.hanning(len(values))
    power = np.abs(np.fft.rfft(values * window)) ** 2
    frequency = np.fft.rfftfreq(len(values), 1.0 / rate)
    lowest = int(np.searchsorted(frequency, _LOWEST_LINE_FREQUENCY))
    if len(power) - lowest < 2 * _LINE_NEIGHBOURHOOD:
        return None, 0.0
    peak = lowest + int(np.argmax(power[lowest:]))
    around = power[max(peak - _LINE_NEIGHBOURHOOD, 0) : peak + _LINE_NEIGHBOURHOOD].copy()
    centre = min(peak, _LINE_NEIGHBOURHOOD)
    around[max(centre - _LINE_WIDTH, 0) : centre + _LINE_WIDTH + 1] = 0.0
    threshold = max(_LINE_POWER_RATIO * float(np.median(around)), _LINE_PEAK_RATIO * float(around.max()))
    if power[peak] < threshold:
        return None, 0.0
    amplitude = float(2.0 * np.sqrt(power[peak]) / np.sum(window))
    return float(frequency[peak]) + float(frequency[1]) * _locate_peak(power, peak), amplitude


def _locate_peak(power: Array, peak: int) -> float:
    """Return where a peak lies between its bins [bins], by a parabola through the logarithms of three of them.

    The spectrum of a Hann window is nearly a parabola there, so the error is some hundredths of a bin.
    """
    if not 0 < peak < len(power) - 1:
        return 0.0
    left, middle, right = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    return float(0.5 * (left - right) / min(left - 2.0 * middle + right, -1e-12))
