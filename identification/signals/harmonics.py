"""Harmonics of a periodic stroke.

A servo under load does not follow a pure sine: its motion contains harmonics of the stroke. After the frequency is
refined by Gauss-Newton, they are a linear regression, which averages the displacement noise over the segment.

Only harmonics above the noise are used, and only steady cycles are fitted. The smoother handles a soft start
inside the segment. It also handles disturbances, in which the rod leaves its wave for some hundredths of a second.
In a regression, a disturbance would change every other cycle as well.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from identification.arrays import Array, BoolArray
from identification.signals.harmonic_sums import evaluate_harmonics, make_normal_equations

_FIRST_HARMONICS = 20
"""Number of harmonics tried at first; doubled while high ones are significant, as at the corners of a triangle."""
_EXTENSION_SHARE = 0.75
"""Order over the highest tried order: if a significant one is above it, more harmonics are tried."""
_DISTURBANCE_RATIO = 6.0
"""Threshold on the deviation from the wave over its standard deviation: above it, there is a disturbance."""
_AVERAGING_TIME = 0.008
"""Time [s] over which that deviation is averaged; disturbances last longer."""
_ITERATIONS = 8
_MAX_FREQUENCY = 60.0
"""Frequency [Hz] above which the harmonics of a damper's stroke are left to the smoother."""
_MIN_CYCLES = 2.0
_MIN_SIGNIFICANCE = 4.0
"""Threshold on the power of a harmonic over that of noise alone: below it, the harmonic is not used."""
_UNSTEADY_RATIO = 3.0
"""Threshold on the remainder of a cycle over that of the middle cycles: above it, the cycle is unsteady."""
_MIN_UNDISTURBED = 0.5
"""Smallest undisturbed part of a cycle; with less it does not count as steady."""
_MAX_DISTURBED_CYCLES = 3
"""Largest number of successive disturbed cycles; after more, the stroke counts as ended."""
_FEW_HARMONICS = 4
"""Number of harmonics from which frequency and steadiness are found."""


class Harmonics(NamedTuple):
    """Periodic part of a displacement between two samples."""

    start: int
    """First sample."""
    stop: int
    """One past the last sample."""
    frequency: float
    """Achieved frequency of the stroke [Hz]."""
    orders: tuple[int, ...]
    """Orders of the significant harmonics."""
    values: Array
    """(stop - start,) offset, drift and harmonics [m]."""
    disturbance: Array
    """(stop - start,) distance of the rod from them in disturbances [m]; 0 elsewhere."""


class SteadyCycles(NamedTuple):
    """Steady cycles of a segment."""

    start: int
    """First sample."""
    stop: int
    """One past the last sample."""
    frequency: float
    """Achieved frequency [Hz]."""
    disturbance: Array
    """(N,) distance of the rod from its wave in disturbances [m]; 0 elsewhere."""


def fit_harmonics(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> Harmonics | None:
    """Fit the harmonics of a segment's steady cycles.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured, 0 elsewhere.
        rate: [Hz].
        frequency: planned frequency of the stroke [Hz].
        noise: standard deviation of the displacement's noise [m].

    Returns:
        The fit, counted from the segment's first sample; None if fewer than two cycles are steady.
    """
    steady = find_steady_cycles(values, weights, rate, frequency, noise)
    if steady is None:
        return None
    part = slice(steady.start, steady.stop)
    harmonics = _fit(values[part], weights[part], rate, steady.frequency, noise, steady.disturbance[part] > 0.0)
    return harmonics._replace(start=steady.start, stop=steady.stop)


def find_steady_cycles(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> SteadyCycles | None:
    """Find the steady cycles of a segment on decimated samples; None if fewer than two are steady.

    The arguments are those of `fit_harmonics`.
    """
    if len(values) * frequency < _MIN_CYCLES * rate:
        return None
    # Frequency and steadiness need six samples a cycle of the highest harmonic used here, and 3000 in all.
    stride = max(1, min(len(values) // 3000, int(rate / (24.0 * frequency))))
    decimated = values[::stride], weights[::stride]
    start, stop, frequency, disturbance = _grow_steady_part(*decimated, rate / stride, frequency, noise)
    # A disturbance begins and ends between two decimated samples.
    disturbance = maximum_filter1d(disturbance, 3)
    start, stop = start * stride, min(stop * stride, len(values))
    if (stop - start) * frequency < _MIN_CYCLES * rate - 1.0:
        return None
    return SteadyCycles(start, stop, frequency, np.repeat(disturbance, stride)[: len(values)])


def _fit(
    values: Array, weights: Array, rate: float, frequency: float, noise: float, disturbed: BoolArray
) -> Harmonics:
    """Fit harmonics to all samples outside disturbances, starting from those that are known."""
    window = max(round(_AVERAGING_TIME * rate), 1)
    for _ in range(_ITERATIONS):
        orders, wave = _select_harmonics(values, np.where(disturbed, 0.0, weights), rate, frequency, noise)
        deviation = np.convolve((values - wave) * weights, np.full(window, 1.0 / window), "same")
        previous = disturbed
        disturbed = _find_disturbances(deviation, slice(None), weights, noise / np.sqrt(window))
        if np.array_equal(previous, disturbed):
            break
    return Harmonics(0, len(values), frequency, orders, wave, np.where(disturbed, np.abs(deviation), 0.0))


def _find_disturbances(deviation: Array, part: slice, weights: Array, noise: float) -> BoolArray:
    """Return a mask (N,) of deviations [m] far above the median deviation of a part's measured samples."""
    measured = np.abs(deviation[part][weights[part] > 0.0])
    # 1.4826: standard deviation of a normal variable over its median magnitude.
    scale = 1.4826 * float(np.median(measured)) if len(measured) else 0.0
    return np.asarray(np.abs(deviation) > _DISTURBANCE_RATIO * max(scale, noise))


def _select_harmonics(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> tuple[tuple[int, ...], Array]:
    """Return the significant orders, and the signal (N,) of these harmonics."""
    highest = max(int(min(_MAX_FREQUENCY / frequency, 0.2 * rate / frequency)), 1)
    count = min(_FIRST_HARMONICS, highest)
    while True:
        orders, wave = _fit_significant(values, weights, count, frequency / rate, noise)
        if count == highest or orders[-1] <= _EXTENSION_SHARE * count:
            return orders, wave
        count = min(2 * count, highest)


def _fit_significant(
    values: Array, weights: Array, count: int, step: float, noise: float
) -> tuple[tuple[int, ...], Array]:
    """Return the significant orders among the first ``count`` and their signal (N,); step in cycles a sample."""
    equations = make_normal_equations(values, weights, count, step)
    amplitudes = _solve(equations.matrix, equations.moments)
    waves = amplitudes[2:].reshape(-1, 2)
    power = np.sum(waves**2, axis=1)
    # Noise alone gives a cosine and a sine 2 noise² / N each.
    significant = power > _MIN_SIGNIFICANCE * 4.0 * noise**2 / max(float(np.sum(weights)), 1.0)
    significant[0] = True
    # Over whole cycles the orders are nearly orthogonal, so no second regression is needed.
    amplitudes[2:] = (waves * significant[:, None]).ravel()
    orders = tuple(int(k) + 1 for k in np.flatnonzero(significant))
    return orders, evaluate_harmonics(amplitudes, len(values), step)


def _grow_steady_part(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> tuple[int, int, float, Array]:
    """Grow the steady part from the middle, by cycles that follow the wave fitted there outside disturbances.

    Returns:
        First sample, one past the last, achieved frequency [Hz], and the disturbance (N,) [m].
    """
    middle, reach = len(values) // 2, max(len(values) // 4, int(rate / frequency))
    # A soft start is at an end of the segment, so the middle is the most reliable part.
    start, stop = max(middle - reach, 0), min(middle + reach, len(values))
    disturbed = np.zeros(len(values), bool)
    for _ in range(_ITERATIONS):
        frequency, deviation = _refine_frequency(
            values, np.where(disturbed, 0.0, weights), rate, frequency, start, stop
        )
        deviation *= weights
        previous = disturbed
        disturbed = _find_disturbances(deviation, slice(start, stop), weights, noise)
        usual = float(np.sqrt(np.mean(deviation[start:stop][~disturbed[start:stop]] ** 2)))
        run = _find_cycle_run(deviation, disturbed, rate / frequency, _UNSTEADY_RATIO * max(usual, noise))
        if run == (start, stop) and np.array_equal(previous, disturbed):
            break
        start, stop = run
    return start, stop, frequency, np.where(disturbed, np.abs(deviation), 0.0)


def _refine_frequency(
    values: Array, weights: Array, rate: float, frequency: float, start: int, stop: int
) -> tuple[float, Array]:
    """Refine a frequency [Hz] by Gauss-Newton between two samples; return it and the remainder (N,) [m]."""
    # Counted from the middle, where an error of the frequency does not change the phases.
    position: Array = np.arange(float(len(values))) - 0.5 * (start + stop)
    part = slice(start, stop)
    angle = 2.0 * np.pi * position[part] / rate
    for _ in range(4):
        basis = _make_basis(position[part], _FEW_HARMONICS, frequency / rate)
        amplitudes = _regress(basis, values[part], weights[part])
        sensitivity = _differentiate_by_phase(basis, amplitudes) * angle
        change = _regress(np.vstack([basis, sensitivity]), values[part], weights[part])[-1]
        # Far from the achieved frequency a full step may diverge.
        frequency += float(np.clip(change, -0.05 * frequency, 0.05 * frequency))
    basis = _make_basis(position, _FEW_HARMONICS, frequency / rate)
    amplitudes = _regress(basis[:, part], values[part], weights[part])
    return frequency, values - amplitudes @ basis


def _differentiate_by_phase(basis: Array, amplitudes: Array) -> Array:
    """Return the derivative (N,) of the few harmonics over the phase [rad] of the first one."""
    factors = np.repeat(np.arange(1, _FEW_HARMONICS + 1), 2) * np.tile([-1.0, 1.0], _FEW_HARMONICS)
    quadrature = basis[2:].reshape(_FEW_HARMONICS, 2, -1)[:, ::-1].reshape(2 * _FEW_HARMONICS, -1)
    return np.asarray((amplitudes[2:] * factors) @ quadrature)


def _find_cycle_run(deviation: Array, disturbed: BoolArray, cycle: float, limit: float) -> tuple[int, int]:
    """Return first and one past last sample of the cycles around the middle whose deviation is below a limit."""
    middle = len(deviation) // 2
    counts = np.concatenate([[0], np.cumsum(~disturbed)])
    squares = np.concatenate([[0.0], np.cumsum(np.where(disturbed, 0.0, deviation) ** 2)])

    def is_steady(a: int, b: int) -> bool:
        count = counts[b] - counts[a]
        return bool(count >= _MIN_UNDISTURBED * (b - a) and squares[b] - squares[a] <= limit**2 * count)

    def measure_reach(sign: int, available: int) -> int:
        """Return the number of samples from the middle to the end of the last steady cycle on one side."""
        reach = position = 0
        while position < available and position - reach < (_MAX_DISTURBED_CYCLES + 0.5) * cycle:
            next_position = min(round((round(position / cycle) + 1) * cycle), available)
            if is_steady(*sorted((middle + sign * position, middle + sign * next_position))):
                reach = next_position
            position = next_position
        return reach

    return middle - measure_reach(-1, middle), middle + measure_reach(1, len(deviation) - middle)


def _make_basis(position: Array, count: int, step: float) -> Array:
    """Return (2 + 2 count, N): one, a slope, then cosine and sine of each order; step is in cycles a sample."""
    # Powers of one rotation are far cheaper than a cosine and a sine for every order.
    rotation = np.exp(2j * np.pi * step * position)
    basis = np.empty((2 + 2 * count, len(position)))
    basis[0], basis[1] = 1.0, position / max(abs(float(position[0])), 1.0)
    wave = np.ones(len(position), complex)
    for k in range(count):
        wave *= rotation
        basis[2 + 2 * k], basis[3 + 2 * k] = wave.real, wave.imag
    return basis


def _regress(basis: Array, values: Array, weights: Array) -> Array:
    """Return the amplitudes of a weighted least-squares fit, the smallest ones for redundant columns."""
    weighted = basis * weights
    return _solve(weighted @ basis.T, weighted @ values)


def _solve(matrix: Array, moments: Array) -> Array:
    return np.asarray(np.linalg.lstsq(matrix, moments, rcond=1e-12)[0])
