"""Smoother with a penalty on third differences (Whittaker 1923, Henderson 1924).

The smooth ``s`` of a measured, uniformly sampled ``x`` minimises

    sum_i w_i (x_i - s_i)² + sum_j q_j ((D³ s)_j - g_j)²

with ``w`` 0 where nothing was measured, ``q`` the penalty of each third difference and ``g`` its expected value
(0, or that of fitted harmonics). In the frequency domain it is a low-pass H = 1 / (1 + (f / cutoff)⁶) without
phase. The penalty is therefore given as a cutoff frequency, which may vary along the signal.

Twicing (Tukey 1977) smooths the remainder in the same way and adds it. Its response 1 - (1 - H)² distorts a motion
far less for the same noise. Distortion matters because a fade is the same in every recording and would bias every
fit alike. The normal equations are banded: a solve costs some 30 ns a sample.
"""

import math

import numpy as np

from identification.arrays import Array, njit_cached

_DERIVATIVE = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
"""Central difference of sixth order; it underestimates the velocity by 2e-5 at 40 samples a cycle."""
_END_DERIVATIVES = (
    np.array([-3.0, 4.0, -1.0]) / 2.0,
    np.array([-1.0, 0.0, 1.0]) / 2.0,
    np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0,
)
"""Differences at the first three samples: one-sided through three samples, then central through three and five."""


def compute_penalty(cutoff: Array | float, rate: float) -> Array:
    """Return the penalty (dimensionless) that halves a signal at the cutoff [Hz], or keeps 3/4 with twicing."""
    return np.asarray((2.0 * np.sin(np.pi * np.asarray(cutoff) / rate)) ** -6.0)


def smooth_signal(
    values: Array, weights: Array, penalty: Array, expected: Array, *, twicing: bool = False
) -> Array:
    """Return the smooth signal (N,), in the unit of the measured one.

    Args:
        values: (N,) measured signal; ignored where its weight is 0.
        weights: (N,) 1 where measured, 0 elsewhere.
        penalty: (N-3,) penalty of each third difference (dimensionless).
        expected: (N-3,) expected third difference, in the signal's unit.
        twicing: whether the remainder is smoothed and added.
    """
    known = np.where(weights > 0, values, 0.0)
    bands = np.empty((4, len(values) + 3))
    _factorise(bands, weights, penalty)
    once = _solve(bands, weights * known, penalty * expected)
    return np.asarray(once + _solve(bands, weights * (known - once), np.zeros(len(penalty))) if twicing else once)


def smooth_below(values: Array, weights: Array, cutoff: float, rate: float) -> Array:
    """Return the part (N,) of a measured signal below a cutoff frequency [Hz]; the weights are 0 or 1."""
    penalty = np.full(len(values) - 3, float(compute_penalty(cutoff, rate)))
    return smooth_signal(values, weights, penalty, np.zeros(len(values) - 3))


@njit_cached
def _factorise(bands: Array, weights: Array, penalty: Array) -> None:
    """Factorise the seven-diagonal normal equations as L D L^T; (4, N + 3) D, then three diagonals of L."""
    main, first, second, third = bands
    count = len(weights)
    # With three zeros below the matrix all rows are treated alike.
    first[:], second[:], third[:] = 0.0, 0.0, 0.0
    main[:count] = weights
    main[count:] = 1.0
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
    # The matrix is positive definite: no pivoting is needed, and three bands suffice.
    for i in range(count):
        low1, low2, low3 = first[i] / main[i], second[i] / main[i], third[i] / main[i]
        main[i + 1] -= low1 * first[i]
        main[i + 2] -= low2 * second[i]
        main[i + 3] -= low3 * third[i]
        first[i + 1] -= low2 * first[i]
        first[i + 2] -= low3 * second[i]
        second[i + 1] -= low3 * first[i]
        first[i], second[i], third[i] = low1, low2, low3


@njit_cached
def _solve(bands: Array, right: Array, load: Array) -> Array:
    """Solve for the signal (N,) under a right side (N,) and loads (N-3,) on the third differences."""
    main, first, second, third = bands
    count = len(right)
    # Three more rows, as in the factors, so that the last rows need no special case.
    solution = np.zeros(count + 3)
    solution[:count] = right
    for j in range(count - 3):
        solution[j] -= load[j]
        solution[j + 1] += 3.0 * load[j]
        solution[j + 2] -= 3.0 * load[j]
        solution[j + 3] += load[j]
    for i in range(count):
        solution[i + 1] -= first[i] * solution[i]
        solution[i + 2] -= second[i] * solution[i]
        solution[i + 3] -= third[i] * solution[i]
    solution[count:] = 0.0
    for i in range(count - 1, -1, -1):
        solution[i] /= main[i]
        solution[i] -= first[i] * solution[i + 1] + second[i] * solution[i + 2] + third[i] * solution[i + 3]
    return solution[:count]


def compute_step_covariance(cutoff: float, rate: float, *, twicing: bool = False) -> float:
    """Return how far the first differences of a smooth follow those of white noise: trace of D S D^T per sample.

    Args:
        cutoff: cutoff frequency of the smoother [Hz].
        rate: [Hz].
        twicing: whether it smooths its remainder again.

    Returns:
        Covariance of smoothed and measured first differences over the noise variance (dimensionless).
    """
    angle = (np.arange(4096) + 0.5) * math.pi / 4096
    step = (2.0 * np.sin(angle / 2.0)) ** 2
    attenuation = 1.0 - 1.0 / (1.0 + float(compute_penalty(cutoff, rate)) * step**3)
    return float(np.mean(step * (1.0 - attenuation ** (2 if twicing else 1))))


def differentiate(values: Array, rate: float) -> Array:
    """Return the derivative [unit/s] of a smooth signal (N,) [unit], of lower order towards the ends.

    At its ends the smoother leaves a parabola. A one-sided difference of higher order would amplify its noise.
    """
    slope = np.convolve(values, _DERIVATIVE[::-1], "same")
    # The convolution assumes zeros beyond the ends.
    for k, row in enumerate(_END_DERIVATIVES):
        slope[k] = row @ values[: len(row)]
        slope[-1 - k] = -row @ values[: -1 - len(row) : -1]
    return np.asarray(slope * rate)
