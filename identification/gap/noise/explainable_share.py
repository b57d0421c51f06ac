"""Explainable share: part of the gap that a flexible regression on stroke, drive and time predicts.

The regression names no cause. What it predicts on held-out cycles is structure in motion, drive or time. The
rest is noise, or depends on a quantity that was not recorded. It is a ridge regression on random Fourier
features (Rahimi and Recht 2007) of the stroke and its past.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.damper.effects import Variable
from identification.fitting import Piece, measure_scales
from identification.gap.data import NEAR_FLOOR_RATIO, EvaluationData
from identification.gap.fits import Candidate
from identification.gap.noise.simulated_noise import simulate_noise
from identification.simulate import filter_series

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
FEATURE_VARIABLES: dict[Variable, tuple[int, ...]] = {
    "displacement": (0,),
    "velocity": (1, 4, 6, 7),
    "acceleration": (2,),
    "drive": (3,),
    "travel_since_reversal": (5,),
    "drive_history": (8, 9),
    "time": (10,),
}
"""Columns of the features that belong to each variable."""
_NOISE_DRAWS = 8
"""Number of draws of slow noise."""
_SLOW = 0.5
"""Highest frequency of slow noise, over the lowest one of the strokes [1]: a line of the strokes is above it."""
_CHANCE_DEVIATIONS = 2.0
"""Standard deviations between these draws that count as chance."""
_REVERSAL_SHARE = 1e-3
"""Distance from the last reversal, over half the stroke, at which its logarithmic feature begins to grow [1]."""


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
    shortest = max(0.5 * _REVERSAL_SHARE * float(np.ptp(x)), 1e-12)
    distance = np.log1p(np.abs(x - _find_last_reversal(x, v)) / shortest) * np.sign(v)
    return np.column_stack([x, v, piece.excitation.acceleration, u, direction, distance, *past])


def _low_pass(values: Array, samples: float) -> Array:
    """Filter values with a low-pass of this time constant [samples], settled at the first value."""
    decay = float(np.exp(-1.0 / max(samples, 1e-3)))
    b, a = np.array([1.0 - decay, 0.0]), np.array([1.0, -decay])
    return filter_series(b, a, values, np.array([decay * values[0]]))


def _find_last_reversal(x: Array, v: Array) -> Array:
    """Return the displacement [m] of the last reversal before each sample, (N,)."""
    turned = np.concatenate([[True], np.sign(v[1:]) != np.sign(v[:-1])])
    return x[np.maximum.accumulate(np.where(turned, np.arange(len(x)), 0))]


@dataclass(frozen=True)
class ResidualRegression:
    """Regression on the residuals of fitted sets of effects; each is computed once."""

    evaluation: EvaluationData
    floor: float
    """Noise of the force [N]."""
    _known: dict[frozenset[str], "Explained"] = field(default_factory=dict)

    @cached_property
    def _features(self) -> Array:
        """(N, k) features of the recording."""
        return build_features(self.evaluation.pieces)

    @cached_property
    def _lowest_frequency(self) -> float:
        """Lowest frequency of the strokes [Hz]; where none repeat, that of a sine of their size and speed."""
        found = [c.frequency for c in self.evaluation.cycles.conditions if c.frequency]
        return min(found) if found else 1.0 / measure_scales(self.evaluation.pieces).cycle_duration

    def explain(self, candidate: Candidate) -> "Explained":
        """Return the part of a set's residual that the regression predicts; none near the noise floor."""
        if candidate.held_out_rmse < NEAR_FLOOR_RATIO * self.floor:
            return Explained(0.0, dict.fromkeys(FEATURE_VARIABLES, 0.0))
        if candidate.names not in self._known:
            self._known[candidate.names] = explain_residual(
                self._features,
                candidate.residual.values,
                self.evaluation.fitted_samples,
                self.evaluation.held_out_samples,
                self.floor,
                FEATURE_VARIABLES,
                simulate_noise(candidate.residual, _NOISE_DRAWS, _SLOW * self._lowest_frequency),
            )
        return self._known[candidate.names]

    def find_explainable_rmse(self, candidates: Sequence[Candidate], noise: float, certain: bool = False) -> float:
        """Return the lowest held-out RMSE [N] that the regression reaches on top of any of some sets.

        Args:
            candidates: sets of effects.
            noise: noise of the force [N].
            certain: True to leave out what slow noise explains.
        """
        explained = [(c, self.explain(c)) for c in candidates]
        shares = [(c, e.certain_share if certain else e.share) for c, e in explained]
        return min(
            math.sqrt(noise**2 + (1.0 - share) * max(c.held_out_rmse**2 - noise**2, 0.0)) for c, share in shares
        )


class Explained(NamedTuple):
    """Part of a residual that a flexible regression predicts on held-out samples."""

    share: float
    """Part of the excess variance, 0 to 1."""
    losses: dict[Variable, float]
    """Part of the excess variance that is lost when a variable is exchanged between samples, by variable."""
    chance: float = 0.0
    """Part of the excess variance that would be predicted if what is slower than the strokes were noise."""

    @property
    def certain_share(self) -> float:
        """Part of the excess variance beyond what slow noise explains, 0 to 1."""
        return max(self.share - self.chance, 0.0)


def explain_residual(
    features: Array,
    residual: Array,
    train: BoolArray,
    held_out: BoolArray,
    floor: float,
    variables: Mapping[Variable, Sequence[int]] = MappingProxyType({}),
    noise: Array | None = None,
) -> Explained:
    """Estimate the part of the residual's excess variance that the features predict on held-out samples.

    Noise that is slower than a stroke hardly changes from fitted samples to the next held-out ones, so a part of
    it is predicted as well. That part is measured on simulated noise.

    Args:
        features: standardised features (N, k).
        residual: residual [N], (N,).
        train: mask (N,) of the samples for the regression.
        held_out: mask (N,) of the samples that are predicted.
        floor: noise of the force [N].
        variables: columns of each variable whose loss is estimated.
        noise: draws (N, K) [N] of the slow noise that the residual may contain.
    """
    excess = float(np.mean(residual[held_out] ** 2)) - floor**2
    if excess <= 0.0:
        return Explained(0.0, dict.fromkeys(variables, 0.0))
    compute_basis = _draw_basis(features.shape[1])
    fitted, predicted = _subsample(train), _subsample(held_out)
    table = features[predicted]
    values = residual[:, None] if noise is None else np.column_stack([residual, noise])
    target = values[predicted]
    weights, errors = _fit_weights(compute_basis(features[fitted]), values[fitted], compute_basis(table), target)
    share, *by_chance = (np.mean(target**2, axis=0) - errors) / excess

    def compute_loss(columns: Sequence[int]) -> float:
        exchanged = compute_basis(_exchange(table, columns)) @ weights[:, 0]
        return float(np.mean((target[:, 0] - exchanged) ** 2) - errors[0]) / excess

    losses = {v: compute_loss(c) for v, c in variables.items()}
    return Explained(float(np.clip(share, 0.0, 1.0)), losses, _bound_chance(np.array(by_chance)))


def _fit_weights(fitted: Array, values: Array, predicted: Array, target: Array) -> tuple[Array, Array]:
    """Return the weights (B, K) [N] of ridge regressions with the best penalty each, and their errors (K,) [N²].

    Args:
        fitted: basis (F, B) on the fitted samples.
        values: values (F, K) [N] there.
        predicted: basis (P, B) on the predicted samples.
        target: values (P, K) [N] there.
    """
    gram, moments = fitted.T @ fitted, fitted.T @ values
    identity = 1e-2 * len(fitted) * np.eye(len(gram))
    weights = np.stack([np.linalg.solve(gram + r * identity, moments) for r in _RIDGE_PENALTIES])
    errors = np.mean((target - predicted @ weights) ** 2, axis=1)
    best = np.argmin(errors, axis=0), np.arange(values.shape[1])
    return weights[best[0], :, best[1]].T, errors[best]


def _bound_chance(shares: Array) -> float:
    """Return the share that is predicted by chance, from those (K,) of draws of noise."""
    return max(float(shares.mean() + _CHANCE_DEVIATIONS * shares.std()), 0.0) if len(shares) else 0.0


def _draw_basis(count: int) -> Callable[[Array], Array]:
    """Return the function from features (N, count) to the regression's basis (N, B)."""
    random = np.random.default_rng(0)
    frequencies = random.standard_normal((count, _FEATURE_COUNT)) * random.choice(
        _FEATURE_SCALES, (1, _FEATURE_COUNT)
    )
    shifts = random.uniform(0.0, 2.0 * np.pi, _FEATURE_COUNT)
    return lambda table: np.hstack([np.ones((len(table), 1)), table, np.cos(table @ frequencies + shifts)])


def _exchange(table: Array, columns: Sequence[int]) -> Array:
    """Return features (N, k) with some columns exchanged between samples."""
    exchanged, order = table.copy(), np.random.default_rng(1).permutation(len(table))
    exchanged[:, list(columns)] = table[order][:, list(columns)]
    return exchanged


def _subsample(mask: BoolArray) -> Indices:
    """Return the indices of some selected samples, evenly spaced."""
    rows = np.flatnonzero(mask)
    return rows[:: max(1, len(rows) // _MAX_SAMPLES)]
