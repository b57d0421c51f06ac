"""Explainable share: part of the gap that a flexible regression on stroke, drive and time predicts.

The regression names no cause. What it predicts on held-out cycles is structure in motion, drive or time. The
rest is noise, or depends on a quantity that was not recorded. It is a ridge regression on random Fourier
features (Rahimi and Recht 2007) of the stroke and its past.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from identification.arrays import Array, BoolArray
from identification.fitting import Piece

Indices = npt.NDArray[np.intp]

_FEATURE_COUNT = 400
"""Number of random Fourier features."""
_FEATURE_SCALES = (0.3, 1.0)
"""Frequencies of the features, relative to the standard deviation of their inputs."""
_MAX_SAMPLES = 24_000
"""Approximate limit on the samples of one regression."""
_RIDGE_PENALTIES = (1e-3, 1e-2, 1e-1, 1.0)
"""Ridge penalties that are tried, per hundred samples."""
_TIME_CONSTANTS = (0.01, 0.1)
"""Time constants of the low-pass filters of the stroke's past [s]."""
_SIGN_WIDTH = 0.1
"""Width of the smoothed sign of the velocity, relative to its standard deviation."""
_REVERSAL_LENGTH = 1e-5
"""Distance from the last reversal at which its logarithmic feature begins to grow [m]."""


def build_features(pieces: Sequence[Piece]) -> Array:
    """Return features (N, k) of the stroke and its past, standardised.

    They are displacement, velocity, acceleration, drive, past velocity and drive, distance from the last reversal,
    and time.
    """
    table = np.concatenate([_build_piece_features(p) for p in pieces])
    time = np.linspace(0.0, 1.0, len(table))[:, None]
    table = np.hstack([table, time])
    return np.asarray((table - table.mean(axis=0)) / np.maximum(table.std(axis=0), 1e-12))


def _build_piece_features(piece: Piece) -> Array:
    x, v, u = piece.excitation.displacement, piece.excitation.velocity, piece.excitation.drive
    past = [_low_pass(signal, tau * piece.excitation.rate) for signal in (v, u) for tau in _TIME_CONSTANTS]
    direction = np.tanh(v / max(_SIGN_WIDTH * float(np.std(v)), 1e-12))
    distance = np.log1p(np.abs(x - _find_last_reversal(x, v)) / _REVERSAL_LENGTH) * np.sign(v)
    return np.column_stack([x, v, piece.excitation.acceleration, u, direction, distance, *past])


def _low_pass(values: Array, samples: float) -> Array:
    """Filter values with a low-pass of this time constant [samples], settled at the first value."""
    decay = float(np.exp(-1.0 / max(samples, 1e-3)))
    return np.asarray(lfilter([1.0 - decay], [1.0, -decay], values, zi=np.array([decay * values[0]]))[0])


def _find_last_reversal(x: Array, v: Array) -> Array:
    """Return the displacement [m] of the last reversal before each sample, (N,)."""
    turned = np.concatenate([[True], np.sign(v[1:]) != np.sign(v[:-1])])
    return x[np.maximum.accumulate(np.where(turned, np.arange(len(x)), 0))]


def estimate_explainable_share(
    features: Array, residual: Array, train: BoolArray, held_out: BoolArray, floor: float
) -> float:
    """Estimate the part of the residual's excess variance that the features predict on held-out samples, 0 to 1.

    Args:
        features: standardised features (N, k).
        residual: residual [N], (N,).
        train: mask (N,) of the samples for the regression.
        held_out: mask (N,) of the samples that are predicted.
        floor: noise of the force [N].
    """
    excess = float(np.mean(residual[held_out] ** 2)) - floor**2
    if excess <= 0.0:
        return 0.0
    random = np.random.default_rng(0)
    frequencies = random.standard_normal((features.shape[1], _FEATURE_COUNT)) * random.choice(
        _FEATURE_SCALES, (1, _FEATURE_COUNT)
    )
    shifts = random.uniform(0.0, 2.0 * np.pi, _FEATURE_COUNT)

    def compute_basis(rows: Indices) -> Array:
        table = features[rows]
        return np.hstack([np.ones((len(table), 1)), table, np.cos(table @ frequencies + shifts)])

    fitted, predicted = _subsample(train), _subsample(held_out)
    basis, test = compute_basis(fitted), compute_basis(predicted)
    gram, moment = basis.T @ basis, basis.T @ residual[fitted]
    best = 0.0
    for ridge in _RIDGE_PENALTIES:
        weights = np.linalg.solve(gram + ridge * len(fitted) * 1e-2 * np.eye(len(gram)), moment)
        remaining = float(np.mean((residual[predicted] - test @ weights) ** 2))
        best = max(best, (float(np.mean(residual[predicted] ** 2)) - remaining) / excess)
    return float(np.clip(best, 0.0, 1.0))


def _subsample(mask: BoolArray) -> Indices:
    """Return the indices of some selected samples, evenly spaced."""
    rows = np.flatnonzero(mask)
    return rows[:: max(1, len(rows) // _MAX_SAMPLES)]
