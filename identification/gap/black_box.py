"""How much of the gap any model of the stroke could explain: a ridge on random features of its history.

It names no cause. What it predicts on cycles that it never saw is structure in motion, drive or time; what it
does not is noise, or hangs on something that nobody recorded. Random Fourier features (Rahimi and Recht 2007).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from identification.arrays import Array, BoolArray
from identification.piece import Piece

Indices = npt.NDArray[np.intp]

_FEATURES = 400
_ROWS = 24_000
_RIDGES = (1e-3, 1e-2, 1e-1, 1.0)
"""[1] penalties tried, per row."""
_MEMORIES = (0.01, 0.1)
"""[s] time constants of the low-passed history."""


def history(pieces: Sequence[Piece]) -> Array:
    """(N, features) of the stroke and its past, each of order one.

    Displacement, velocity, acceleration, drive and drive before, way since the last turn, and time.
    """
    rows = [_of_one(p) for p in pieces]
    table = np.concatenate(rows)
    time = np.linspace(0.0, 1.0, len(table))[:, None]
    table = np.hstack([table, time])
    return np.asarray((table - table.mean(axis=0)) / np.maximum(table.std(axis=0), 1e-12))


def _of_one(piece: Piece) -> Array:
    x, v, u = piece.stroke.displacement, piece.stroke.velocity, piece.stroke.drive
    past = [_slow(signal, tau * piece.stroke.rate) for signal in (v, u) for tau in _MEMORIES]
    fast = np.tanh(v / max(0.1 * float(np.std(v)), 1e-12))
    way = np.log1p(np.abs(x - _last_turn(x, v)) / 1e-5) * np.sign(v)
    return np.column_stack([x, v, piece.stroke.acceleration, u, fast, way, *past])


def _slow(values: Array, samples: float) -> Array:
    """The values behind a low-pass of so many samples, settled at the first."""
    keep = float(np.exp(-1.0 / max(samples, 1e-3)))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, zi=np.array([keep * values[0]]))[0])


def _last_turn(x: Array, v: Array) -> Array:
    """(N,) displacement [m] where the motion last turned."""
    turned = np.concatenate([[True], np.sign(v[1:]) != np.sign(v[:-1])])
    return x[np.maximum.accumulate(np.where(turned, np.arange(len(x)), 0))]


def explainable(features: Array, residual: Array, train: BoolArray, held: BoolArray, floor: float) -> float:
    """Part of the residual's variance beyond the floor that the features predict on what is held out, 0 to 1.

    Args:
        features: (N, k) of order one.
        residual: (N,) [N].
        train: (N,) samples to learn from.
        held: (N,) samples to predict.
        floor: noise of the force [N].
    """
    excess = float(np.mean(residual[held] ** 2)) - floor**2
    if excess <= 0.0:
        return 0.0
    random = np.random.default_rng(0)
    slopes = random.standard_normal((features.shape[1], _FEATURES)) * random.choice([0.3, 1.0], (1, _FEATURES))
    shifts = random.uniform(0.0, 2.0 * np.pi, _FEATURES)

    def basis(rows: Indices) -> Array:
        table = features[rows]
        return np.hstack([np.ones((len(table), 1)), table, np.cos(table @ slopes + shifts)])

    known, asked = _some(train), _some(held)
    learnt, answers = basis(known), residual[known]
    gram, right, test = learnt.T @ learnt, learnt.T @ answers, basis(asked)
    best = 0.0
    for ridge in _RIDGES:
        weights = np.linalg.solve(gram + ridge * len(known) * 1e-2 * np.eye(len(gram)), right)
        rest = float(np.mean((residual[asked] - test @ weights) ** 2))
        best = max(best, (float(np.mean(residual[asked] ** 2)) - rest) / excess)
    return float(np.clip(best, 0.0, 1.0))


def _some(mask: BoolArray) -> Indices:
    """Indices of some of the marked samples, evenly."""
    rows = np.flatnonzero(mask)
    return rows[:: max(1, len(rows) // _ROWS)]
