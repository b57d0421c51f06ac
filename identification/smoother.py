"""Smooths a uniformly sampled signal by a penalty on its third differences (Whittaker 1923, Henderson 1924).

The smooth ``s`` of the measured ``x`` minimises

    sum_i w_i (x_i - s_i)² + sum_j q_j ((D³ s)_j - g_j)²

with ``w`` 0 where nothing was measured, ``q`` the stiffness of each third difference and ``g`` the third
difference that is expected of it (0, or that of fitted harmonics). In the frequency domain it is a low-pass
H = 1 / (1 + (f / cutoff)⁶) without phase; stiffness is therefore given as a cutoff frequency, and may differ from
place to place. Smoothed twice, what was left out is smoothed in the same way and added ("twicing", Tukey 1977):
1 - (1 - H)² bends a motion far less for the same noise. A fade is the same in every recording, so that what it
loses there would pull every fit the same way. The normal equations are banded: a solve costs some 30 ns a sample.
"""

import math

import numpy as np

from identification.arrays import Array, compiled

_DERIVATIVE = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
"""Central difference of sixth order: 2e-5 of the velocity is lost at 40 samples a cycle."""


def stiffness(cutoff: Array | float, rate: float) -> Array:
    """Penalty [1] of the third differences that halves the signal at the cutoff [Hz]; smoothed twice, 3/4 stay."""
    return np.asarray((2.0 * np.sin(np.pi * np.asarray(cutoff) / rate)) ** -6.0)


def smoothed(values: Array, weights: Array, penalty: Array, expected: Array, *, twice: bool = False) -> Array:
    """The smooth of a signal.

    Args:
        values: (N,) measured signal; ignored where its weight is 0.
        weights: (N,) 1 where measured, 0 where not.
        penalty: (N-3,) stiffness [1] of each third difference.
        expected: (N-3,) third difference that is expected, in the signal's unit.
        twice: whether what was left out is smoothed, too.

    Returns:
        (N,) smooth, in the signal's unit.
    """
    known = np.where(weights > 0, values, 0.0)
    bands = np.ones((4, len(values) + 3))
    _factorise(bands, weights, penalty)
    once = _solved(bands, weights * known, penalty * expected)
    return np.asarray(once + _solved(bands, weights * (known - once), np.zeros(len(penalty))) if twice else once)


@compiled
def _factorise(bands: Array, weights: Array, penalty: Array) -> None:
    """The seven-diagonal normal equations as L D L^T, (4, N + 3): D, then the three diagonals of L."""
    main, first, second, third = bands
    count = len(weights)
    # Three zeros below the matrix let every row be treated alike.
    first[:], second[:], third[:] = 0.0, 0.0, 0.0
    main[:count] = weights
    for j in range(count - 3):
        q = penalty[j]
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
    # Positive definite: no rows need to change places, and the bands stay three wide.
    for i in range(count):
        low1, low2, low3 = first[i] / main[i], second[i] / main[i], third[i] / main[i]
        main[i + 1] -= low1 * first[i]
        main[i + 2] -= low2 * second[i]
        main[i + 3] -= low3 * third[i]
        first[i + 1] -= low2 * first[i]
        first[i + 2] -= low3 * second[i]
        second[i + 1] -= low3 * first[i]
        first[i], second[i], third[i] = low1, low2, low3


@compiled
def _solved(bands: Array, right: Array, push: Array) -> Array:
    """The signal (N,) that answers a right side (N,) and pushes (N-3,) on the third differences: down, then up."""
    main, first, second, third = bands
    count = len(right)
    # Three more, as in the factors, so that the last rows need no case of their own.
    found = np.zeros(count + 3)
    found[:count] = right
    for j in range(count - 3):
        found[j] -= push[j]
        found[j + 1] += 3.0 * push[j]
        found[j + 2] -= 3.0 * push[j]
        found[j + 3] += push[j]
    for i in range(count):
        found[i + 1] -= first[i] * found[i]
        found[i + 2] -= second[i] * found[i]
        found[i + 3] -= third[i] * found[i]
    found[count:] = 0.0
    for i in range(count - 1, -1, -1):
        found[i] /= main[i]
        found[i] -= first[i] * found[i + 1] + second[i] * found[i + 2] + third[i] * found[i + 3]
    return found[:count]


def kept_noise(cutoff: float, rate: float, *, twice: bool = False) -> float:
    """Trace of D S D^T for each sample [1]: how far a smooth's steps follow steps of white noise in its data.

    Args:
        cutoff: of the smoother [Hz].
        rate: [Hz].
        twice: whether it smooths twice.

    Returns:
        Twice the covariance [1] of smoothed and measured first differences over the noise variance.
    """
    angle = (np.arange(4096) + 0.5) * math.pi / 4096
    step = (2.0 * np.sin(angle / 2.0)) ** 2
    left = 1.0 - 1.0 / (1.0 + float(stiffness(cutoff, rate)) * step**3)
    return float(np.mean(step * (1.0 - left ** (2 if twice else 1))))


def derivative(values: Array, rate: float) -> Array:
    """First derivative [unit/s] of a smooth signal (N,) [unit]; one-sided formulas of equal order at the ends."""
    slope = np.convolve(values, _DERIVATIVE[::-1], "same")
    # The convolution takes what lies beyond the ends for zero.
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
