"""Normal equations of many harmonics, from sums over the samples.

The products of two harmonics are harmonics of the sum and of the difference of their orders. So the sums of twice
as many harmonics give all elements of the normal equations, in one pass without a table of harmonics by samples.
"""

import math
from typing import NamedTuple

import numpy as np

from identification.arrays import Array, njit_cached


class NormalEquations(NamedTuple):
    """Normal equations of an offset, a slope, and a cosine and a sine of each order, in this order."""

    matrix: Array
    """(2 + 2 count, 2 + 2 count) weighted products of two terms, summed over the samples [1]."""
    moments: Array
    """(2 + 2 count,) weighted products with the values, in the unit of the values."""


@njit_cached
def _sum_harmonics(values: Array, weights: Array, count: int, step: float) -> tuple[Array, Array]:
    """Return sums over the samples: of each order, and of the slope.

    Args:
        values: (N,) any signal.
        weights: (N,) weight of each sample [1].
        count: number of orders.
        step: frequency of the first order [cycles a sample].

    Returns:
        The sums (6, 2 count + 1) of cosine and sine of the orders from zero, weighted by the weights, by the slope
        and by the values; then (2,) the sums of the squared slope and of the slope times the values.
    """
    sums, squares = np.zeros((6, 2 * count + 1)), np.zeros(2)
    half = 0.5 * len(values)
    for i in range(len(values)):
        weight = weights[i]
        if weight == 0.0:
            continue
        position = i - half
        slope, value = weight * position / max(half, 1.0), weight * values[i]
        squares[0] += slope * position / max(half, 1.0)
        squares[1] += slope * values[i]
        angle = 2.0 * math.pi * step * position
        turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
        cosine, sine = 1.0, 0.0
        for k in range(2 * count + 1):
            sums[0, k] += weight * cosine
            sums[1, k] += weight * sine
            if k <= count:
                sums[2, k] += slope * cosine
                sums[3, k] += slope * sine
                sums[4, k] += value * cosine
                sums[5, k] += value * sine
            cosine, sine = cosine * turn_cosine - sine * turn_sine, cosine * turn_sine + sine * turn_cosine
    return sums, squares


def make_normal_equations(values: Array, weights: Array, count: int, step: float) -> NormalEquations:
    """Return the normal equations of a weighted least-squares fit of harmonics.

    The slope runs from -1 at the first sample to about 1 at the last. Phases count from the middle.

    Args:
        values: (N,) any signal.
        weights: (N,) weight of each sample [1].
        count: number of orders.
        step: frequency of the first order [cycles a sample].
    """
    sums, (slope_square, slope_moment) = _sum_harmonics(values, weights, count, step)
    cosines, sines = sums[0], sums[1]
    orders = np.arange(1, count + 1)
    total, difference = orders[:, None] + orders, orders[:, None] - orders
    distance, sign = np.abs(difference), np.sign(difference)
    matrix = np.empty((2 + 2 * count, 2 + 2 * count))
    matrix[0, 0], matrix[1, 1] = cosines[0], slope_square
    matrix[0, 1] = matrix[1, 0] = sums[2, 0]
    for row, start in ((0, 0), (1, 2)):
        matrix[row, 2::2] = matrix[2::2, row] = sums[start, 1 : count + 1]
        matrix[row, 3::2] = matrix[3::2, row] = sums[start + 1, 1 : count + 1]
    matrix[2::2, 2::2] = 0.5 * (cosines[distance] + cosines[total])
    matrix[3::2, 3::2] = 0.5 * (cosines[distance] - cosines[total])
    matrix[3::2, 2::2] = 0.5 * (sines[total] + sign * sines[distance])
    matrix[2::2, 3::2] = matrix[3::2, 2::2].T
    moments = np.empty(2 + 2 * count)
    moments[0], moments[1] = sums[4, 0], slope_moment
    moments[2::2], moments[3::2] = sums[4, 1 : count + 1], sums[5, 1 : count + 1]
    return NormalEquations(matrix, moments)


@njit_cached
def evaluate_harmonics(amplitudes: Array, samples: int, step: float) -> Array:
    """Return the signal (N,) of an offset, a slope and harmonics.

    Args:
        amplitudes: (2 + 2 count,) in the order of `NormalEquations`.
        samples: number of samples.
        step: frequency of the first order [cycles a sample].
    """
    signal, half = np.empty(samples), 0.5 * samples
    count = 0
    for k in range(2, len(amplitudes)):
        if amplitudes[k] != 0.0:
            count = k // 2
    for i in range(samples):
        position = i - half
        angle = 2.0 * math.pi * step * position
        turn_cosine, turn_sine = math.cos(angle), math.sin(angle)
        cosine, sine = turn_cosine, turn_sine
        value = amplitudes[0] + amplitudes[1] * position / max(half, 1.0)
        for k in range(count):
            value += amplitudes[2 + 2 * k] * cosine + amplitudes[3 + 2 * k] * sine
            cosine, sine = cosine * turn_cosine - sine * turn_sine, cosine * turn_sine + sine * turn_cosine
        signal[i] = value
    return signal
