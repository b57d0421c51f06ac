"""Evidence for a curve: marginal likelihood of a linear model with one prior deviation (MacKay 1992).

The law and the effects that are already named are projected out of the residual and of the curve's sensitivities.
A ridge regression on the curve's coefficients remains. The prior deviation with the largest evidence sets
smoothness and amplitude.
"""

import math
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.fitting import Evaluation, Problem
from identification.gap.data import Indices

_DEVIATIONS = np.geomspace(1e-4, 1e2, 43)
"""Prior deviations of the coefficients that are tried [1]."""
_RELATIVE_DAMPING = 1e-9
"""Damping of the projection, relative to the curvature of each unknown."""


class CurveEvidence(NamedTuple):
    """Result of the linear model."""

    log_odds: float
    """Logarithm of the odds (natural) of the curve over none."""
    deviation: float
    """Most probable prior deviation of the coefficients [1]."""
    step: Array
    """(U,) step of all unknowns from the linearisation point to the most probable curve."""


def compute_curve_evidence(joint: Problem, here: Evaluation, unknowns: Array, columns: slice) -> CurveEvidence:
    """Compute the evidence for a curve from cost, gradient and curvature at a curve of zero.

    An unknown of the law at a bound is held if its step would leave the bound.

    Args:
        joint: problem with the curve.
        here: its evaluation.
        unknowns: (U,) unknowns of this evaluation.
        columns: unknowns of the curve's coefficients.
    """
    low, high = joint.get_bounds()
    inner = np.arange(len(unknowns))[columns]
    free = joint.free_mask.copy()
    free[inner] = False
    for _ in range(len(unknowns)):
        evidence = _compute_evidence(joint, here, np.flatnonzero(free), inner)
        below, above = np.isclose(unknowns, low) & (evidence.step < 0.0), evidence.step > 0.0
        beyond = below | (np.isclose(unknowns, high) & above)
        if not (free & beyond).any():
            break
        free &= ~beyond
    return evidence


def _compute_evidence(joint: Problem, here: Evaluation, outer: Indices, inner: Indices) -> CurveEvidence:
    """Compute the evidence with some unknowns projected out (their indices) and the others held."""
    H, g = here.hessian, here.gradient
    damped = H[np.ix_(outer, outer)] + np.diag(_RELATIVE_DAMPING * np.diag(H)[outer])
    projection = np.linalg.lstsq(damped, np.column_stack([H[np.ix_(outer, inner)], g[outer]]), rcond=None)[0]
    S = H[np.ix_(inner, inner)] - H[np.ix_(inner, outer)] @ projection[:, :-1]
    b = g[inner] - H[np.ix_(inner, outer)] @ projection[:, -1]
    eigenvalues, vectors = np.linalg.eigh(0.5 * (S + S.T))
    eigenvalues, z = np.maximum(eigenvalues, 0.0), vectors.T @ b
    law_cost = here.cost - float(g[outer] @ projection[:, -1])
    variance = _estimate_variance(eigenvalues, z, law_cost, joint.samples)
    odds = [_compute_log_odds(eigenvalues, z, s**2, variance) for s in _DEVIATIONS]
    best = int(np.argmax(odds))
    deviation = float(_DEVIATIONS[best])
    weights = -z / (eigenvalues + variance / deviation**2)
    step = np.zeros(len(g))
    step[inner] = vectors @ weights
    step[outer] = -projection[:, -1] - projection[:, :-1] @ step[inner]
    # In a fit, errors are over the noise of the problem: the prior is scaled to the same balance.
    return CurveEvidence(odds[best], deviation / math.sqrt(variance), step)


def _estimate_variance(eigenvalues: Array, z: Array, law_cost: float, samples: int) -> float:
    """Return the noise variance over that of the problem: the error that the best curve leaves, at least one.

    Errors are taken as independent, so the odds are far too certain. They only rank the curves; held-out
    strokes decide.
    """
    gain = float(np.sum(z**2 / np.maximum(eigenvalues, 1e-9 * eigenvalues.max() + 1e-300)))
    return max((law_cost - min(gain, law_cost)) / samples, 1.0)


def _compute_log_odds(eigenvalues: Array, z: Array, prior: float, variance: float) -> float:
    """Return the log odds for a prior variance and a noise variance, both over the problem's own."""
    shrunk = prior * z**2 / (variance * (variance + prior * eigenvalues))
    return 0.5 * float(np.sum(shrunk - np.log1p(prior * eigenvalues / variance)))
