"""Choice of variables, length scales and ridge by the error on conditions that were left out.

Neighbouring samples, and cycles of one condition, are nearly copies of each other. Leaving whole conditions out
measures what a residual is needed for: strokes that were not recorded.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls

from identification.arrays import Array
from identification.residual.gaussian_process import Basis, Moments, Posterior, add_moments

_RIDGES = tuple(10.0**k for k in np.arange(-3.0, 3.0, 0.5))
"""Ridges that are tried, over the number of samples per support point."""
_ROUNDS = 2
"""Rounds over all variables."""
_MIN_GAIN = 1e-3
"""Smallest reduction of the error for which a length scale is changed or a variable is left out, over the error
without a residual [1]."""
_USUAL_RATE = 0.5
"""Reciprocal length scale at which a variable enters [1]."""
_FACTORS = (0.5, 2.0, 0.0)
"""Changes of a reciprocal length scale that are tried; zero leaves its variable out."""

Indices = npt.NDArray[np.intp]


class Choice(NamedTuple):
    """Settings of a residual and their error."""

    rates: Array
    """(D,) reciprocal length scales [1]; zero for a variable that is left out."""
    ridge: float
    """Variance of a sample's noise over that of the prior [1]."""
    error: float
    """Squared error on left-out conditions over that without a residual [1]."""


@dataclass(frozen=True)
class CrossValidation:
    """Samples by condition."""

    states: Array
    """(N, D) states."""
    residual: Array
    """(N,) residual [N]."""
    condition: Indices
    """(N,) number of each sample's condition."""
    points: Array
    """(M, D) support points."""

    def thin(self, samples: int) -> "CrossValidation":
        """Return about as many samples as stated, taken evenly, with the same support points."""
        every = slice(None, None, max(1, round(len(self.residual) / samples)))
        return replace(
            self, states=self.states[every], residual=self.residual[every], condition=self.condition[every]
        )

    def choose(self, rates: Array) -> Choice:
        """Return the best settings near some reciprocal length scales (D,), one variable after the other."""
        best = self.evaluate(rates)
        for _ in range(_ROUNDS):
            before = best
            for column in range(self.states.shape[1]):
                best = self._improve(best, column)
            if best is before:
                break
        return best

    def evaluate(self, rates: Array) -> Choice:
        """Return the settings with the best ridge for some reciprocal length scales (D,)."""
        basis = self._make_basis(rates)
        parts = [self.condition == c for c in np.unique(self.condition)]
        moments = [basis.compute_moments(self.states[part] * rates, self.residual[part]) for part in parts]
        errors = _compute_left_out_errors(moments, [r * self._samples_per_point for r in _RIDGES])
        best = int(np.argmin(errors))
        return Choice(rates, _RIDGES[best] * self._samples_per_point, float(errors[best]))

    def fit(self, choice: Choice) -> tuple[Basis, Posterior]:
        """Return basis and weights from all samples."""
        basis = self._make_basis(choice.rates)
        values = basis.evaluate(self.states * choice.rates)
        return basis, Posterior.make(Moments.make(values, self.residual), choice.ridge)

    def estimate_variances(self, choice: Choice) -> tuple[float, float]:
        """Estimate the variance of the prior and that of what no residual predicts [N²] from left-out conditions.

        The squared error on left-out conditions is the sum of both: the first times the relative variance there.
        """
        basis = self._make_basis(choice.rates)
        values = basis.evaluate(self.states * choice.rates)
        parts = [self.condition == c for c in np.unique(self.condition)]
        moments = [Moments.make(values[part], self.residual[part]) for part in parts]
        total = add_moments(moments)
        relative, squares = np.empty(len(values)), np.empty(len(values))
        for part, own in zip(parts, moments, strict=True):
            others = Posterior.make(total - own, choice.ridge)
            relative[part] = others.compute_variance(values[part])
            squares[part] = (self.residual[part] - values[part] @ others.weights) ** 2
        design = np.column_stack([relative, np.ones(len(relative))])
        prior, rest = nnls(design, squares)[0]
        return float(prior), float(rest)

    def _improve(self, best: Choice, column: int) -> Choice:
        """Return the best of a choice and those with another length scale of one variable.

        A variable is left out only where that reduces the error. Without it a residual is the same at all its
        values, also where nothing was recorded.
        """
        for factor in _FACTORS:
            rates = best.rates.copy()
            rates[column] = rates[column] * factor if rates[column] else (_USUAL_RATE if factor > 1.0 else 0.0)
            if rates[column] != best.rates[column] and rates.any():
                other = self.evaluate(rates)
                best = other if other.error < best.error - _MIN_GAIN else best
        return best

    def _make_basis(self, rates: Array) -> Basis:
        return Basis.make(self.points * rates)

    @property
    def _samples_per_point(self) -> float:
        return len(self.residual) / len(self.points)


def _compute_left_out_errors(moments: Sequence[Moments], ridges: Sequence[float]) -> Array:
    """Return the error (ridges,) on each condition, predicted from the others, over that without a residual."""
    total = add_moments(list(moments))
    errors = np.zeros(len(ridges))
    for own in moments:
        others = total - own
        values, vectors = np.linalg.eigh(others.gram)
        turned = Moments(vectors.T @ own.gram @ vectors, vectors.T @ own.moment, own.square)
        moment = vectors.T @ others.moment
        errors += [turned.compute_squared_error(moment / (np.maximum(values, 0.0) + ridge)) for ridge in ridges]
    return np.asarray(errors / max(total.square, 1e-300))
