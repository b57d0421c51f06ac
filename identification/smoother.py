"""Smooths a uniformly sampled signal by a penalty on its third differences (Whittaker 1923, Henderson 1924).

The smooth ``s`` of the measured ``x`` minimises

    sum_i w_i (x_i - s_i)² + sum_j q_j ((D³ s)_j - g_j)²

with ``w`` 0 where nothing was measured, ``q`` the stiffness of each third difference and ``g`` the third
difference that is expected of it (0, or that of fitted harmonics). In the frequency domain it is a low-pass
1 / (1 + (f / cutoff)⁶) without phase; stiffness is therefore given as a cutoff frequency, and may differ from
place to place. The normal equations are banded: a solve costs some 20 ns a sample.
"""

import math

import numpy as np

from identification.arrays import Array, compiled

_DERIVATIVE = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
"""Central difference of sixth order: 2e-5 of the velocity is lost at 40 samples a cycle."""


def stiffness(cutoff: Array | float, rate: float) -> Array:
    """Penalty [1] of the third differences that halves the signal at the cutoff [Hz]."""
    return np.asarray((2.0 * np.sin(np.pi * np.asarray(cutoff) / rate)) ** -6.0)


def smoothed(values: Array, weights: Array, penalty: Array, expected: Array) -> Array:
    """The smooth of a signal.

    Args:
        values: (N,) measured signal; ignored where its weight is 0.
        weights: (N,) 1 where measured, 0 where not.
        penalty: (N-3,) stiffness [1] of each third difference.
        expected: (N-3,) third difference that is expected, in the signal's unit.

    Returns:
        (N,) smooth, in the signal's unit.
    """
    return np.asarray(_solve(np.where(weights > 0, values, 0.0), weights, penalty, expected))


@compiled
def _solve(values: Array, weights: Array, penalty: Array, expected: Array) -> Array:
    """Assembles the seven-diagonal normal equations and solves them."""
    count = len(values)
    # Three zeros below the matrix let every row be treated alike.
    main, first = np.ones(count + 3), np.zeros(count + 3)
    second, third, right = np.zeros(count + 3), np.zeros(count + 3), np.zeros(count + 3)
    main[:count], right[:count] = weights, weights * values
    for j in range(count - 3):
        q, push = penalty[j], penalty[j] * expected[j]
        main[j] += q
        main[j + 1] += 9.0 * q
        main[j + 2] += 9.0 * q
        main[j + 3] += q
        first[j] -= 3.0 * q
        first[j + 1] -= 9.0 * q
        first[j + 2] -= 3.0 * q
        second[j] += 3.0 * q
        second[j + 1] += 3.0 * q
        third[j] -= q
        right[j] -= push
        right[j + 1] += 3.0 * push
        right[j + 2] -= 3.0 * push
        right[j + 3] += push
    _eliminate(main, first, second, third, right, count)
    return right[:count]


@compiled
def _eliminate(main: Array, first: Array, second: Array, third: Array, right: Array, count: int) -> None:
    """Solves a symmetric band (main and three lower diagonals) in place by LDL^T: one sweep down, one up."""
    for i in range(count):
        low1, low2, low3 = first[i] / main[i], second[i] / main[i], third[i] / main[i]
        main[i + 1] -= low1 * first[i]
        main[i + 2] -= low2 * second[i]
        main[i + 3] -= low3 * third[i]
        first[i + 1] -= low2 * first[i]
        first[i + 2] -= low3 * second[i]
        second[i + 1] -= low3 * first[i]
        right[i + 1] -= low1 * right[i]
        right[i + 2] -= low2 * right[i]
        right[i + 3] -= low3 * right[i]
        first[i], second[i], third[i] = low1, low2, low3
    right[count:] = 0.0
    for i in range(count - 1, -1, -1):
        right[i] /= main[i]
        right[i] -= first[i] * right[i + 1] + second[i] * right[i + 2] + third[i] * right[i + 3]


def kept_noise(cutoff: float, rate: float) -> float:
    """Trace of D S D^T for each sample [1]: how far a smooth's steps follow steps of white noise in its data.

    Args:
        cutoff: of the smoother [Hz].
        rate: [Hz].

    Returns:
        Twice the covariance [1] of smoothed and measured first differences over the noise variance.
    """
    angle = (np.arange(4096) + 0.5) * math.pi / 4096
    step = (2.0 * np.sin(angle / 2.0)) ** 2
    return float(np.mean(step / (1.0 + float(stiffness(cutoff, rate)) * step**3)))


def derivative(values: Array, rate: float) -> Array:
    """First derivative [unit/s] of a smooth signal (N,) [unit]; one-sided formulas of equal order at the ends."""
    slope = np.convolve(values, _DERIVATIVE[::-1], "same")
    places = np.arange(7.0)
    for k in range(3):
        row = _weights(places - k)
        slope[k] = row @ values[:7]
        slope[-1 - k] = -row @ values[-1:-8:-1]
    return np.asarray(slope * rate)


def _weights(places: Array) -> Array:
    """Weights (7,) of the values at these places (in samples) that give the slope at 0."""
    powers = places[None, :] ** np.arange(len(places))[:, None]
    return np.asarray(np.linalg.solve(powers, np.eye(len(places))[1]))
