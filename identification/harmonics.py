"""Fits the harmonics of a periodic stroke.

A servo under load does not follow a pure sine: its motion carries harmonics of the stroke. With the fundamental
refined by Gauss-Newton they are a linear regression, which averages the displacement noise over the whole
segment. Only harmonics above the noise are kept, and only the steady cycles are fitted: a soft start inside the
segment is left to the smoother. So is a stumble, where the rod leaves its wave for some hundredths of a second
since a setpoint came late or something knocked: fitted along, it would leave an echo in every other cycle.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from identification.arrays import Array, BoolArray

_FIRST_HARMONICS = 20
"""[1] tried at first; twice as many where the highest of them still count, as at the corners of a triangle."""
_STILL_COUNT = 0.75
"""[1] share of the harmonics tried beyond which one that counts asks for more of them."""
_STUMBLE = 6.0
"""[1] The rod stumbles where it is so many deviations, as most samples have them, off its wave."""
_GLANCE = 0.008
"""[s] over which that is averaged: a stumble lasts longer."""
_ROUNDS = 8
_HIGHEST = 60.0
"""[Hz] Above it the harmonics of a damper's stroke are left to the smoother."""
_FEWEST_CYCLES = 2.0
_CHANCE = 4.0
"""A harmonic stays if its power is this many times what noise alone would give it."""
_UNSTEADY = 3.0
"""A cycle is unsteady if its remainder is this many times that of the middle ones."""
_SOUND = 0.5
"""[1] part of a cycle that keeps to the wave; with less it is no cycle of it."""
_PATIENCE = 3
"""Cycles in a row that may stumble before the stroke counts as ended."""
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
    off: Array
    """(stop - start,) by how much the rod leaves them where it stumbles [m]; 0 elsewhere."""


class Steady(NamedTuple):
    """The cycles of a segment that repeat."""

    start: int
    """First sample."""
    stop: int
    """One past the last sample."""
    frequency: float
    """As it was achieved [Hz]."""
    off: Array
    """(N,) by how much the rod leaves its wave where it stumbles [m]; 0 elsewhere."""


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
    part = slice(steady.start, steady.stop)
    fitted = _fit(values[part], weights[part], rate, steady.frequency, noise, steady.off[part] > 0.0)
    return fitted._replace(start=steady.start, stop=steady.stop)


def steady_cycles(values: Array, weights: Array, rate: float, frequency: float, noise: float) -> Steady | None:
    """The steady cycles of a segment, on thinned samples: all but the harmonics themselves.

    Args:
        values, weights, rate, frequency, noise: as ``fit_harmonics`` takes them.

    Returns:
        None where fewer than two are steady.
    """
    if len(values) * frequency < _FEWEST_CYCLES * rate:
        return None
    # Six samples a cycle of the highest harmonic used here, and 3000 in all, fix frequency and steadiness.
    stride = max(1, min(len(values) // 3000, int(rate / (24.0 * frequency))))
    start, stop, frequency, off = _steady(values[::stride], weights[::stride], rate / stride, frequency, noise)
    # A stumble begins and ends somewhere between two thinned samples.
    off = maximum_filter1d(off, 3)
    start, stop = start * stride, min(stop * stride, len(values))
    if (stop - start) * frequency < _FEWEST_CYCLES * rate - 1.0:
        return None
    return Steady(start, stop, frequency, np.repeat(off, stride)[: len(values)])


def _fit(
    values: Array, weights: Array, rate: float, frequency: float, noise: float, stumbled: BoolArray
) -> Harmonics:
    """The harmonics over all samples given, but for stumbles; those known already keep their echo out at once."""
    glance = max(round(_GLANCE * rate), 1)
    for _ in range(_ROUNDS):
        orders, fitted = _harmonics(values, np.where(stumbled, 0.0, weights), rate, frequency, noise)
        off = np.convolve((values - fitted) * weights, np.full(glance, 1.0 / glance), "same")
        before, stumbled = stumbled, _standing_out(off, slice(None), weights, noise / np.sqrt(glance))
        if np.array_equal(before, stumbled):
            break
    return Harmonics(0, len(values), frequency, orders, fitted, np.where(stumbled, np.abs(off), 0.0))


def _standing_out(rest: Array, part: slice, weights: Array, noise: float) -> BoolArray:
    """(N,) True where what a wave leaves [m] stands out; the middle of a part's samples tells what is usual."""
    known = np.abs(rest[part][weights[part] > 0.0])
    usual = 1.4826 * float(np.median(known)) if len(known) else 0.0
    return np.asarray(np.abs(rest) > _STUMBLE * max(usual, noise))


def _harmonics(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> tuple[tuple[int, ...], Array]:
    """Significant orders, and the signal (N,) that they make over all samples."""
    highest = max(int(min(_HIGHEST / frequency, 0.2 * rate / frequency)), 1)
    tried = min(_FIRST_HARMONICS, highest)
    while True:
        orders, fitted = _significant(values, weights, tried, frequency / rate, noise)
        if tried == highest or orders[-1] <= _STILL_COUNT * tried:
            return orders, fitted
        tried = min(2 * tried, highest)


def _significant(
    values: Array, weights: Array, tried: int, step: float, noise: float
) -> tuple[tuple[int, ...], Array]:
    """Orders above chance among those tried, and the signal (N,) that they make; step is in cycles a sample."""
    basis = _basis(np.arange(float(len(values))) - 0.5 * len(values), tried, step)
    amplitudes = _regress(basis, values, weights)
    waves = amplitudes[2:].reshape(-1, 2)
    power = np.sum(waves**2, axis=1)
    # Noise alone gives a cosine and a sine 2 noise² / N each.
    kept = power > _CHANCE * 4.0 * noise**2 / max(float(np.sum(weights)), 1.0)
    kept[0] = True
    # Over whole cycles the orders are all but orthogonal: those that stay need no second regression.
    amplitudes[2:] = (waves * kept[:, None]).ravel()
    return tuple(int(k) + 1 for k in np.flatnonzero(kept)), np.asarray(amplitudes @ basis)


def _steady(
    values: Array, weights: Array, rate: float, frequency: float, noise: float
) -> tuple[int, int, float, Array]:
    """The steady cycles (first sample, one past the last), the achieved frequency [Hz] and how far stumbles went.

    Grown from the middle: the cycles that keep to what is fitted there, but for stumbles.
    """
    middle, reach = len(values) // 2, max(len(values) // 4, int(rate / frequency))
    # A soft start stands at an end of the segment: its middle is the surest part.
    start, stop = max(middle - reach, 0), min(middle + reach, len(values))
    stumbled = np.zeros(len(values), bool)
    for _ in range(_ROUNDS):
        frequency, rest = _extended(values, np.where(stumbled, 0.0, weights), rate, frequency, start, stop)
        rest *= weights
        before, stumbled = stumbled, _standing_out(rest, slice(start, stop), weights, noise)
        usual = float(np.sqrt(np.mean(rest[start:stop][~stumbled[start:stop]] ** 2)))
        grown = _run_of_cycles(rest, stumbled, rate / frequency, _UNSTEADY * max(usual, noise))
        if grown == (start, stop) and np.array_equal(before, stumbled):
            break
        start, stop = grown
    return start, stop, frequency, np.where(stumbled, np.abs(rest), 0.0)


def _extended(
    values: Array, weights: Array, rate: float, frequency: float, start: int, stop: int
) -> tuple[float, Array]:
    """Frequency [Hz] refined by Gauss-Newton between two samples, and what few harmonics leave everywhere [m]."""
    # Counted from the middle, where an error of the frequency is no error of the phases.
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
        # Far from the achieved frequency a whole step may go astray.
        frequency += float(np.clip(change, -0.05 * frequency, 0.05 * frequency))
    basis = _basis(place, _FEW, frequency / rate)
    amplitudes = _regress(basis[:, inside], values[inside], weights[inside])
    return frequency, values - amplitudes @ basis


def _run_of_cycles(rest: Array, stumbled: BoolArray, cycle: float, limit: float) -> tuple[int, int]:
    """The cycles around the middle (first sample, one past the last) that keep below a limit, all but a few."""
    middle = len(rest) // 2
    sound = np.concatenate([[0], np.cumsum(~stumbled)])
    sums = np.concatenate([[0.0], np.cumsum(np.where(stumbled, 0.0, rest) ** 2)])

    def good(a: int, b: int) -> bool:
        left = sound[b] - sound[a]
        return bool(left >= _SOUND * (b - a) and sums[b] - sums[a] <= limit**2 * left)

    def reach(sign: int, room: int) -> int:
        """Samples from the middle to the end of the last good cycle on one side."""
        far = looked = 0
        while looked < room and looked - far < (_PATIENCE + 0.5) * cycle:
            further = min(round((round(looked / cycle) + 1) * cycle), room)
            if good(*sorted((middle + sign * looked, middle + sign * further))):
                far = further
            looked = further
        return far

    return middle - reach(-1, middle), middle + reach(1, len(rest) - middle)


def _basis(place: Array, highest: int, step: float) -> Array:
    """(2 + 2 highest, N): one, a slope, then cosine and sine of each order; step is in cycles a sample."""
    # Powers of one turn: far cheaper than a cosine and a sine for every order.
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
