"""Gaussian process with few support points: regression of a residual on the state.

Prior: zero mean, squared exponential covariance. Far from all samples the mean returns to zero and the deviation
to that of the prior, so nothing is extrapolated. The support points replace the samples, as in the
subset-of-regressors approximation with corrected variance (Quinonero-Candela and Rasmussen 2005, section 5).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from identification.arrays import Array

_JITTER = 1e-6
"""Diagonal added to a covariance matrix [1], so that its Cholesky factor exists."""


@dataclass(frozen=True)
class Basis:
    """Basis functions of the process: M support points in D dimensions, already divided by the length scales."""

    points: Array
    """(M, D) support points."""
    factor: Array
    """(M, M) lower Cholesky factor of their covariance."""

    @staticmethod
    def make(points: Array) -> "Basis":
        """Factorise the covariance of some support points (M, D)."""
        covariance = _compute_covariance(points, points) + _JITTER * np.eye(len(points))
        return Basis(points, np.asarray(cholesky(covariance, lower=True)))

    def evaluate(self, states: Array) -> Array:
        """Return the basis (N, M) at scaled states (N, D); its weights have independent unit priors."""
        covariance = _compute_covariance(self.points, states)
        return np.asarray(solve_triangular(self.factor, covariance, lower=True).T)

    def compute_moments(self, states: Array, residual: Array) -> "Moments":
        """Return the sums over scaled states (N, D) and a residual (N,) [N]; their basis (N, M) is not needed."""
        sums = Moments.make(_compute_covariance(states, self.points), residual)
        half = solve_triangular(self.factor, sums.gram, lower=True)
        return Moments(
            np.asarray(solve_triangular(self.factor, half.T, lower=True)),
            np.asarray(solve_triangular(self.factor, sums.moment, lower=True)),
            sums.square,
        )


class Moments(NamedTuple):
    """Sums over the samples of one condition, from which weights and errors follow."""

    gram: Array
    """(M, M) products of the basis."""
    moment: Array
    """(M,) products of basis and residual [N]."""
    square: float
    """Sum of the squared residual [N²]."""

    @staticmethod
    def make(basis: Array, residual: Array) -> "Moments":
        """Return the sums for a basis (N, M) and a residual (N,) [N]."""
        return Moments(basis.T @ basis, basis.T @ residual, float(residual @ residual))

    def __sub__(self, other: "Moments") -> "Moments":
        """Return the sums without those of another condition."""
        return Moments(self.gram - other.gram, self.moment - other.moment, self.square - other.square)

    def compute_squared_error(self, weights: Array) -> float:
        """Return the sum of squared errors [N²] with some weights (M,) [N]."""
        return float(self.square - 2.0 * weights @ self.moment + weights @ self.gram @ weights)


def add_moments(moments: list[Moments]) -> Moments:
    """Return the sums over all conditions."""
    return Moments(
        np.asarray(sum(m.gram for m in moments)),
        np.asarray(sum(m.moment for m in moments)),
        sum(m.square for m in moments),
    )


@dataclass(frozen=True)
class Posterior:
    """Weights of the basis after some samples."""

    weights: Array
    """(M,) mean of the weights [N]."""
    factor: Array
    """(M, M) lower Cholesky factor of gram matrix plus ridge."""
    ridge: float
    """Variance of a sample's noise over that of the prior [1]."""

    @staticmethod
    def make(moments: Moments, ridge: float) -> "Posterior":
        """Return the weights after the samples of some sums."""
        factor = cholesky(moments.gram + ridge * np.eye(len(moments.gram)), lower=True)
        return Posterior(np.asarray(cho_solve((factor, True), moments.moment)), np.asarray(factor), ridge)

    def compute_variance(self, basis: Array) -> Array:
        """Return the variance (N,) of the process over that of its prior [1]: zero at samples, one far away."""
        known = np.sum(solve_triangular(self.factor, basis.T, lower=True) ** 2, axis=0)
        return np.asarray(self.ridge * known + np.maximum(1.0 - np.sum(basis**2, axis=1), 0.0))


def _compute_covariance(a: Array, b: Array) -> Array:
    """Return the prior covariance (A, B) between points (A, D) and (B, D)."""
    squares = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2.0 * a @ b.T
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)))
