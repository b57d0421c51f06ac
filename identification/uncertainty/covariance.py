"""Covariance of the unknowns at the minimum of a fit.

It is the covariance of least squares, scaled by the remaining misfit. Where the misfit is coloured, neighbouring
residuals are not independent. The scores summed over blocks of time account for that (block sandwich, White 1980,
Newey and West 1987). The larger of the two variances is used.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import Coordinates
from identification.fitting import COORDINATE_COUNT, Minimum, Problem

_BLOCK_COUNT = 40
"""Number of blocks of a long recording."""
_MIN_BLOCK, _MAX_BLOCK = 0.5, 20.0
"""Shortest and longest block [s]."""
_COLOUR_RATIO = 1.5
"""Threshold on the mean ratio of sandwich to plain variance [1]: above it, the misfit counts as coloured."""
MIN_INFORMATION = 1e-2
"""Threshold on the information of an unknown of order one [1]: below it, it counts as unobservable.

At the threshold the noise would have to be ten times smaller for a deviation of one.
"""
_CORRELATION_LIMIT = 0.9
"""Threshold on the correlation of two coordinates [1]: above it, they are listed as strongly correlated."""


@dataclass(frozen=True)
class Covariance:
    """Covariance of the unknowns, and whether the misfit is coloured."""

    unknowns: Array
    """(U, U); zero in the rows of unknowns that are not interior."""
    observable: BoolArray
    """(U,) True where the unknown is free and the force depends on it."""
    interior: BoolArray
    """(U,) True where the unknown is free, observable and inside its bounds."""
    is_coloured: bool


def estimate_covariance(problem: Problem, minimum: Minimum, scatter: Array | None = None) -> Covariance:
    """Estimate the covariance of the unknowns at a minimum.

    Args:
        problem: minimised problem.
        minimum: its minimum.
        scatter: (U, U) covariance that input noise adds, where it was resampled.
    """
    unknowns = minimum.unknowns
    informative = np.diag(minimum.evaluation.hessian) > MIN_INFORMATION
    interior = problem.find_interior(unknowns) & informative
    H = minimum.evaluation.hessian[np.ix_(interior, interior)]
    # With a diagonal of ones, the limit below applies to directions and not to the units of the unknowns.
    size = np.sqrt(np.diag(H))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(H / np.outer(size, size), rcond=1e-13) / np.outer(size, size)
    # A misfit that is below the noise by chance does not narrow the intervals.
    plain = inverse * max(1.0, minimum.evaluation.cost / problem.samples)
    scores = _compute_block_scores(problem, unknowns)[:, interior]
    sandwich = inverse @ (scores.T @ scores) @ inverse
    ratio = np.diag(sandwich) / np.maximum(np.diag(plain), 1e-300)
    # The mean over many unknowns: with so few blocks, a single ratio varies by chance.
    coloured = bool(ratio[: min(COORDINATE_COUNT, len(ratio))].mean() > _COLOUR_RATIO)
    widening = np.sqrt(np.maximum(ratio, 1.0)) if coloured else np.ones(len(ratio))
    covariance = np.zeros((len(unknowns), len(unknowns)))
    covariance[np.ix_(interior, interior)] = plain * np.outer(widening, widening)
    covariance += 0.0 if scatter is None else scatter
    return Covariance(covariance, problem.free_mask & informative, interior, coloured)


def _compute_block_scores(problem: Problem, unknowns: Array) -> Array:
    """Return the gradient of half the cost, summed over blocks of time (blocks, U)."""
    duration = sum(len(p.force) / p.excitation.rate for p in problem.pieces)
    block = float(np.clip(duration / _BLOCK_COUNT, _MIN_BLOCK, _MAX_BLOCK))
    rows = []
    for i, p in enumerate(problem.pieces):
        r, J = problem.compute_residuals(unknowns, i)
        starts = np.arange(0, len(r), max(1, round(block * p.excitation.rate)))
        table = np.zeros((len(starts), len(unknowns)))
        # Neighbouring errors of a misfit are correlated: they add up in a block, while white ones average out.
        table[:, problem.find_columns(i)] = np.add.reduceat(J * r[:, None], starts, axis=0)
        rows.append(table)
    return np.vstack(rows)


def find_unobservable(covariance: Covariance) -> tuple[set[str], set[str]]:
    """Return the names of the coordinates that are unobservable, and of those at a bound."""
    names = np.array(Coordinates._fields)
    observable = covariance.observable[:COORDINATE_COUNT]
    interior = covariance.interior[:COORDINATE_COUNT]
    return set(names[~observable]), set(names[observable & ~interior])


def compute_coordinate_covariance(problem: Problem, minimum: Minimum, covariance: Covariance) -> Array:
    """Return the covariance (13, 13) of the coordinates."""
    D = problem.space.differentiate(minimum.unknowns[problem.layout.coordinates])
    return D @ covariance.unknowns[:COORDINATE_COUNT, :COORDINATE_COUNT] @ D.T


def find_strong_correlations(covariance: Array) -> dict[str, float]:
    """Return pairs of strongly correlated coordinates with their correlation, from their covariance (13, 13)."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    names = Coordinates._fields
    correlations = {}
    for i in range(len(names)):
        for j in range(i):
            if sd[i] > 0 and sd[j] > 0 and abs(r := covariance[i, j] / (sd[i] * sd[j])) > _CORRELATION_LIMIT:
                correlations[f"{names[j]},{names[i]}"] = round(float(r), 4)
    return correlations
