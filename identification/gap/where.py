"""Where the gap shows: the residual of the refitted law by condition, phase, harmonic and time.

All figures are what is left beyond the noise: the mean square of the residual in a place less that of the floor.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.gap.documents import Drift, Line, Place
from identification.gap.residual import Cycles

_PHASES = 8
_MOST_PLACES = 400
_HARMONICS = 9
_LOWEST_LINE = 40.0
"""[Hz] below which a line could be the stroke's own business."""
_CLEAR = 40.0
"""[1] power of a line over the median of its neighbourhood above which it is one."""
_NARROW = 10.0
"""[1] power of a line over everything else around it."""
_OWN, _AROUND = 3, 200
"""[frequencies] that a line takes itself, and that its neighbourhood reaches."""


@dataclass(frozen=True)
class Left:
    """What a model leaves of the force; (N,) over all stretches one after the other."""

    residual: Array
    """[N] recorded minus simulated force."""
    simulated: Array
    """[N]"""
    drive: Array
    """[V or A]"""
    time: Array
    """[s] since the first sample."""
    valid: BoolArray
    """False where a sample was not measured or lies in the first instants of a stretch."""
    rates: tuple[tuple[int, float], ...]
    """Samples and rate [Hz] of each stretch."""


def gap_map(left: Left, cycles: Cycles, floor: float) -> list[Place]:
    """The gap by drive, amplitude, frequency and phase, the largest first.

    Args:
        left: the residual of the refitted law.
        cycles: of the same samples.
        floor: noise of the force [N].
    """
    names = sorted({_key(c) for c in cycles.conditions})
    place = {name: k for k, name in enumerate(names)}
    owner = np.array([place[_key(c)] for c in cycles.conditions])[cycles.segment]
    inside = left.valid & (cycles.cycle >= 0)
    bins = (cycles.phase[inside] * _PHASES).astype(int) % _PHASES
    index = owner[cycles.cycle[inside]] * _PHASES + bins
    squares = np.bincount(index, left.residual[inside] ** 2, len(names) * _PHASES)
    counts = np.bincount(index, minlength=len(names) * _PHASES)
    gaps = np.sqrt(np.maximum(squares / np.maximum(counts, 1) - floor**2, 0.0))
    found = [
        Place(
            drive=name[0],
            amplitude_m=name[1],
            frequency_hz=name[2],
            phase=(k + 0.5) / _PHASES if name[2] else 0.0,
            gap_n=float(gaps[i * _PHASES + k]),
        )
        for i, name in enumerate(names)
        for k in range(_PHASES)
        if counts[i * _PHASES + k]
    ]
    return sorted(found, key=lambda p: -p.gap_n)[:_MOST_PLACES]


def _key(condition: object) -> tuple[float, float, float]:
    """Drive, amplitude and frequency rounded so that the same stroke met again is the same."""
    drive, amplitude, frequency = vars(condition).values()
    return float(f"{drive:.3g}"), float(f"{amplitude:.2g}"), float(f"{frequency:.3g}")


def harmonics(left: Left, cycles: Cycles) -> list[Line]:
    """The harmonics of the stroke in the residual, over all periodic strokes; empty where none is periodic."""
    power, samples = np.zeros(_HARMONICS), 0
    periodic = np.array([c.frequency > 0 for c in cycles.conditions])[cycles.segment]
    chosen = left.valid & (cycles.cycle >= 0)
    chosen[chosen] = periodic[cycles.cycle[chosen]]
    segment = cycles.segment[cycles.cycle[chosen]]
    residual, phase = left.residual[chosen], cycles.phase[chosen]
    counts = np.bincount(segment, minlength=len(cycles.conditions))
    samples = int(counts.sum())
    if not samples:
        return []
    for order in range(1, _HARMONICS + 1):
        wave = np.exp(-2j * np.pi * order * phase)
        sums = np.bincount(segment, (residual * wave).real, len(counts)) ** 2
        sums += np.bincount(segment, (residual * wave).imag, len(counts)) ** 2
        power[order - 1] = float(np.sum(2.0 * sums / np.maximum(counts, 1)))
    return [Line(order=k + 1, rms_n=float(np.sqrt(p / samples))) for k, p in enumerate(power)]


def drift(left: Left, cycles: Cycles) -> Drift:
    """How the residual goes over time: its mean, the force's size, and lines not locked to the stroke."""
    inside = left.valid & (cycles.cycle >= 0)
    segment = cycles.segment[cycles.cycle[inside]]
    counts = np.bincount(segment, minlength=len(cycles.conditions)).astype(float)
    used = counts > 0
    means = np.bincount(segment, left.residual[inside], len(counts))[used] / counts[used]
    times = np.bincount(segment, left.time[inside], len(counts))[used] / counts[used]
    sizes = _sizes(left, inside, segment, len(counts))[used]
    line, amplitude = strongest_line(left)
    return Drift(
        slope_n_per_s=_slope(times, means, counts[used]),
        mean_rms_n=_spread(means, counts[used]),
        size_change=_slope(times, sizes, counts[used]) * float(np.ptp(left.time)),
        line_hz=line,
        line_n=amplitude,
    )


def _spread(values: Array, weights: Array) -> float:
    """Weighted standard deviation."""
    mean = np.average(values, weights=weights)
    return float(np.sqrt(np.average((values - mean) ** 2, weights=weights)))


def _sizes(left: Left, inside: BoolArray, segment: npt.NDArray[np.intp], count: int) -> Array:
    """(segments,) factor by which the recorded force is larger than the simulated one."""
    simulated, residual = left.simulated[inside], left.residual[inside]
    over = np.bincount(segment, residual * simulated, count)
    under = np.bincount(segment, simulated**2, count)
    return np.asarray(1.0 + over / np.maximum(under, 1e-12))


def _slope(times: Array, values: Array, weights: Array) -> float:
    """Weighted slope of values over time; 0 where there is one time only."""
    if len(times) < 2:
        return 0.0
    t = times - np.average(times, weights=weights)
    return float(np.sum(weights * t * values) / max(np.sum(weights * t * t), 1e-12))


def strongest_line(left: Left) -> tuple[float | None, float]:
    """Frequency [Hz] and amplitude [N] of the strongest line through a whole stretch; (None, 0) without one."""
    start = 0
    best: tuple[float | None, float] = (None, 0.0)
    for count, rate in left.rates:
        found = _line(left.residual[start : start + count], rate)
        best = max(best, found, key=lambda line: line[1])
        start += count
    return best


def _line(residual: Array, rate: float) -> tuple[float | None, float]:
    """The strongest line of one stretch: as narrow as the stretch is long, which no segment's harmonic is."""
    window = np.hanning(len(residual))
    power = np.abs(np.fft.rfft(residual * window)) ** 2
    frequency = np.fft.rfftfreq(len(residual), 1.0 / rate)
    lowest = int(np.searchsorted(frequency, _LOWEST_LINE))
    if len(power) - lowest < 2 * _AROUND:
        return None, 0.0
    peak = lowest + int(np.argmax(power[lowest:]))
    around = power[max(peak - _AROUND, 0) : peak + _AROUND].copy()
    own = min(peak, _AROUND)
    around[max(own - _OWN, 0) : own + _OWN + 1] = 0.0
    if power[peak] < _CLEAR * float(np.median(around)) or power[peak] < _NARROW * float(around.max()):
        return None, 0.0
    return float(frequency[peak]), float(2.0 * np.sqrt(power[peak]) / np.sum(window))
