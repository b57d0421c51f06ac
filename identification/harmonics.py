"""Fits the harmonics of a periodic stroke.

A servo under load does not follow a pure sine: its motion carries harmonics of the stroke. With the fundamental
refined by Gauss-Newton they are a linear regression, which averages the displacement noise over the whole
segment. Only harmonics above the noise are kept, and only the steady cycles are fitted: a soft start inside the
segment is left to the smoother.
"""

from typing import NamedTuple

import numpy as np

from identification.arrays import Array

_FIRST_HARMONICS = 20
"""[1] tried at first; twice as many where the highest of them still count, as at the corners of a triangle."""
_STILL_COUNT = 0.75
"""[1] share of the harmonics tried beyond which one that counts asks for more of them."""
_KNOCK = 4.0
"""[1] What the harmonics leave is a knock where it stands out so many times over nine tenths of the rest."""
_ROUNDS = 3
_HIGHEST = 60.0
"""[Hz] Above it the harmonics of a damper's stroke are left to the smoother."""
_FEWEST_CYCLES = 2.0
_CHANCE = 4.0
"""A harmonic stays if its power is this many times what noise alone would give it."""
_UNSTEADY = 3.0
"""A cycle is unsteady if its remainder is this many times that of the middle ones."""
_FEW = 4
"""Harmonics that tell frequency and steadiness."""


class Harmonics(NamedTuple):
    """The periodic part of a displacement between two samples."""

    start: int
    """First sample."""
    stop: int
    """One past the last sample."""
    frequency: float
    """Of the stroke, as it was achieved [Hz]."""
    orders: tuple[int, ...]
    """Which harmonics were kept."""
    values: Array
    """(stop - start,) offset, drift and harmonics [m]."""


def fit_harmonics(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> Harmonics | None:
    """The harmonics of a segment's steady cycles.

    Args:
        values: (N,) displacement [m].
        weights: (N,) 1 where measured, 0 where not.
        rate: [Hz].
        frequency: of the stroke as planned [Hz].
        noise: standard deviation of the displacement's noise [m].

    Returns:
        The fit, counted from the segment's first sample; None where fewer than two cycles are steady.
    """
    steady = steady_cycles(values, weights, rate, frequency, noise)
    if steady is None:
        return None
    start, stop, frequency = steady
    part = slice(start, stop)
    return _fit(values[part], weights[part], rate, frequency, noise)._replace(start=start, stop=stop)


def steady_cycles(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> tuple[int, int, float] | None:
    """The steady cycles of a segment, on thinned samples: all but the harmonics themselves.

    Args:
        values, weights, rate, frequency, noise: as ``fit_harmonics`` takes them.

    Returns:
        First sample, one past the last, and the achieved frequency [Hz]; None where fewer than two are steady.
    """
    if len(values) * frequency < _FEWEST_CYCLES * rate:
        return None
    stride = max(1, min(len(values) // 3000, int(rate / (24.0 * frequency))))
    start, stop, frequency = _steady(values[::stride], weights[::stride], rate / stride, frequency, noise)
    start, stop = start * stride, min(stop * stride, len(values))
    return (start, stop, frequency) if (stop - start) * frequency >= _FEWEST_CYCLES * rate - 1.0 else None


def _fit(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> Harmonics:
    """The harmonics over all samples given, but for knocks: one would put its echo into every other cycle."""
    sound = weights
    for _ in range(_ROUNDS):
        found = _with_harmonics(values, sound, rate, frequency, noise)
        rest = np.abs(values - found.values)
        knocks = rest > _KNOCK * max(float(np.quantile(rest[weights > 0.0], 0.9)), noise)
        if np.array_equal(sound > 0.0, (weights > 0.0) & ~knocks):
            break
        sound = np.where(knocks, 0.0, weights)
    return found


def _with_harmonics(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> Harmonics:
    """The harmonics over all samples given, as far as they are significant."""
    highest = max(int(min(_HIGHEST / frequency, 0.2 * rate / frequency)), 1)
    tried = min(_FIRST_HARMONICS, highest)
    while True:
        orders, fitted = _significant(values, weights, tried, frequency / rate, noise)
        if tried == highest or orders[-1] <= _STILL_COUNT * tried:
            return Harmonics(0, len(values), frequency, orders, fitted)
        tried = min(2 * tried, highest)


def _significant(
    values: Array, weights: Array, tried: int, step: float, noise: float
) -> tuple[tuple[int, ...], Array]:
    """Orders above chance among those tried, and the signal (N,) that they make; step is in cycles a sample."""
    basis = _basis(np.arange(float(len(values))) - 0.5 * len(values), tried, step)
    amplitudes = _regress(basis, values, weights)
    waves = amplitudes[2:].reshape(-1, 2)
    power = np.sum(waves**2, axis=1)
    kept = power > _CHANCE * 4.0 * noise**2 / max(float(np.sum(weights)), 1.0)
    kept[0] = True
    amplitudes[2:] = (waves * kept[:, None]).ravel()
    return tuple(int(k) + 1 for k in np.flatnonzero(kept)), np.asarray(amplitudes @ basis)


def _steady(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> tuple[int, int, float]:
    """The steady cycles (first sample, one past the last) and the achieved frequency [Hz].

    Grown from the middle: the cycles that keep to what is fitted there.
    """
    middle, reach = len(values) // 2, max(len(values) // 4, int(rate / frequency))
    start, stop = max(middle - reach, 0), min(middle + reach, len(values))
    for _ in range(3):
        frequency, rest = _extended(values, weights, rate, frequency, start, stop)
        usual = float(np.sqrt(np.mean(rest[start:stop] ** 2)))
        grown = _run_of_cycles(rest, rate / frequency, _UNSTEADY * max(usual, noise))
        if grown == (start, stop):
            break
        start, stop = grown
    return start, stop, frequency


def _extended(
    values: Array, weights: Array, rate: float, frequency: float, start: int, stop: int
) -> tuple[float, Array]:
    """Frequency [Hz] refined by Gauss-Newton between two samples, and what the few harmonics leave everywhere."""
    place: Array = np.arange(float(len(values))) - 0.5 * (start + stop)
    inside = slice(start, stop)
    angle = 2.0 * np.pi * place[inside] / rate
    for _ in range(4):
        basis = _basis(place[inside], _FEW, frequency / rate)
        amplitudes = _regress(basis, values[inside], weights[inside])
        orders = np.repeat(np.arange(1, _FEW + 1), 2)
        turned = basis[2:].reshape(_FEW, 2, -1)[:, ::-1].reshape(2 * _FEW, -1)
        slope = (amplitudes[2:] * orders * np.tile([-1.0, 1.0], _FEW)) @ turned * angle
        change = _regress(np.vstack([basis, slope]), values[inside], weights[inside])[-1]
        frequency += float(np.clip(change, -0.05 * frequency, 0.05 * frequency))
    basis = _basis(place, _FEW, frequency / rate)
    amplitudes = _regress(basis[:, inside], values[inside], weights[inside])
    return frequency, (values - amplitudes @ basis) * weights


def _run_of_cycles(rest: Array, cycle: float, limit: float) -> tuple[int, int]:
    """The cycles around the middle (first sample, one past the last) whose remainder stays below a limit."""
    middle = len(rest) // 2
    sums = np.concatenate([[0.0], np.cumsum(rest**2)])

    def reach(sign: int, room: int) -> int:
        """Samples from the middle to the end of the good cycles on one side."""
        good = 0
        while good < room:
            further = min(round((round(good / cycle) + 1) * cycle), room)
            a, b = sorted((middle + sign * good, middle + sign * further))
            if sums[b] - sums[a] > limit**2 * (b - a):
                break
            good = further
        return good

    return middle - reach(-1, middle), middle + reach(1, len(rest) - middle)


def _basis(place: Array, highest: int, step: float) -> Array:
    """(2 + 2 highest, N): one, a slope, then cosine and sine of each order; step is in cycles a sample."""
    turn = np.exp(2j * np.pi * step * place)
    basis = np.empty((2 + 2 * highest, len(place)))
    basis[0], basis[1] = 1.0, place / max(abs(float(place[0])), 1.0)
    wave = np.ones(len(place), complex)
    for k in range(highest):
        wave *= turn
        basis[2 + 2 * k], basis[3 + 2 * k] = wave.real, wave.imag
    return basis


def _regress(basis: Array, values: Array, weights: Array) -> Array:
    """Weighted least squares; columns that say nothing of their own get the smallest amplitudes."""
    weighted = basis * weights
    return np.asarray(np.linalg.lstsq(weighted @ basis.T, weighted @ values, rcond=1e-12)[0])
