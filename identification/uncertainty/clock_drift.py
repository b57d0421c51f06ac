"""Clock drift: a slow change of the force channel's delay within a run, and its effect on a fit.

The difference between the clocks of two devices changes over seconds. A force delay of about ten microseconds
resembles a slightly stiffer damper. It moves k0 and k1 of a clean fit by several of their deviations. The delay
may therefore drift at the end of a fit, linearly between knots. The size of the drift is the one with the largest
likelihood of the residuals, with the knots integrated out (empirical Bayes; Robbins 1956). The unknowns follow by
one Gauss-Newton step from which the knots are eliminated, and their intervals widen accordingly.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import BSpline
from scipy.linalg import block_diag

from identification.arrays import Array, BoolArray
from identification.fitting import COORDINATE_COUNT, Minimum, Problem

_FORCE_DELAY = COORDINATE_COUNT
"""Column of the force delay among the unknowns."""
_KNOT_SPACING = 4.0
"""Time between knots [s]."""
_MIN_DRIFT = 1e-6
"""Smallest drift that is tried [s]."""
_MIN_LIKELIHOOD_GAIN = 6.0
"""Threshold on the gain in twice the log-likelihood [1]: above it, a drift counts as more than chance."""
_TRIALS = 60
"""Number of drift sizes that are tried."""
_MIN_INFORMATION = 1e-9
"""Threshold on the information of a drift direction, relative to the largest [1]: below it, it is left out."""
_REPORT_LIMIT = 10e-6
"""Threshold on the drift [s]: from it on, a note reports the drift."""


class _DriftTerms(NamedTuple):
    """Information and gradient of the B knots, in units of the noise."""

    information: Array
    """(B, B) information of the knots [1/s²]."""
    cross_information: Array
    """(U, B) information shared with the unknowns [1/s]."""
    gradient: Array
    """(B,) gradient of half the cost [1/s]."""


def correct_clock_drift(problem: Problem, minimum: Minimum) -> tuple[Minimum, float]:
    """Return the minimum with a delay of the force that may drift, and the drift's standard deviation [s].

    The information in its ``evaluation`` is what remains with the knots unknown.

    Args:
        problem: minimised problem.
        minimum: its minimum.
    """
    residuals = (problem.compute_residuals(minimum.unknowns, i) for i in range(len(problem.pieces)))
    terms = _make_drift_terms(problem, minimum.unknowns, residuals)
    H, gradient = minimum.evaluation.hessian, minimum.evaluation.gradient
    interior = problem.find_interior(minimum.unknowns)
    free = np.ix_(interior, interior)
    drift = _find_likeliest_drift(terms, H[free], gradient[interior], interior, problem.delay_prior)
    if not drift:
        return minimum, 0.0
    information, step = _solve_step(terms, H, gradient, interior, drift)
    unknowns = np.clip(minimum.unknowns + step, *problem.get_bounds())
    return replace(minimum, unknowns=unknowns, evaluation=replace(minimum.evaluation, hessian=information)), drift


def compute_drift_correction(
    problem: Problem, unknowns: Array, clock_deviation: float
) -> tuple[list[Array], float]:
    """Return the change of the residuals where the delay drifts and the unknowns follow, and the drift.

    Args:
        problem: problem in which all samples in question are marked for the fit.
        unknowns: (U,) of a fit.
        clock_deviation: standard deviation of the clocks [s], which limits the drift.

    Returns:
        Change (N,) of each piece's residuals in units of the noise; root mean square of the drift [s].
    """
    residuals = [problem.compute_residuals(unknowns, i) for i in range(len(problem.pieces))]
    evaluation = problem.evaluate(unknowns)
    terms = _make_drift_terms(problem, unknowns, residuals)
    interior = problem.find_interior(unknowns)
    _, step = _solve_step(terms, evaluation.hessian, evaluation.gradient, interior, clock_deviation)
    knots = -np.linalg.solve(
        _add_drift_prior(terms, clock_deviation), terms.gradient + terms.cross_information.T @ step
    )
    changes, start = [], 0
    for i, (piece, (r, J)) in enumerate(zip(problem.pieces, residuals, strict=True)):
        weights = _make_knot_weights(len(r), piece.excitation.rate)
        piece_knots = knots[start : start + weights.shape[1]]
        changes.append(
            J @ step[problem.find_columns(i)] + (weights @ piece_knots) * J[:, _FORCE_DELAY] / problem.delay_prior
        )
        start += len(piece_knots)
    return changes, float(np.sqrt(np.mean(knots**2)))


def _solve_step(
    terms: _DriftTerms, H: Array, gradient: Array, interior: BoolArray, drift: float
) -> tuple[Array, Array]:
    """Return the information (U, U) on the unknowns that remains with the knots unknown, and their step (U,)."""
    # The knots are eliminated (Schur complement), each with the drift as its prior.
    shared = np.linalg.solve(_add_drift_prior(terms, drift), terms.cross_information.T)
    information, reduced = H - terms.cross_information @ shared, gradient - shared.T @ terms.gradient
    step = np.zeros(len(H))
    step[interior] = -np.linalg.solve(information[np.ix_(interior, interior)], reduced[interior])
    return information, step


def _add_drift_prior(terms: _DriftTerms, drift: float) -> Array:
    return np.asarray(terms.information + np.eye(len(terms.information)) / drift**2)


def describe_clock_drift(drift: float) -> tuple[str, ...]:
    """Return the note on a drift [s]; no note for a small one."""
    if drift < _REPORT_LIMIT:
        return ()
    return (
        f"the delay of the force drifts by {1e6 * drift:.2g} µs within the run, as clocks do; the intervals that "
        "this affects (k0 and k1 most) are widened accordingly",
    )


def _make_drift_terms(problem: Problem, unknowns: Array, residuals: Iterable[tuple[Array, Array]]) -> _DriftTerms:
    """Return the terms of all pieces.

    Args:
        problem: problem with one drift in each piece.
        unknowns: (U,) at which the residuals were computed.
        residuals: residuals (N,) and their derivatives (N, C) of each piece, in units of the noise.
    """
    information, cross_information, gradients = [], [], []
    for i, (piece, (r, J)) in enumerate(zip(problem.pieces, residuals, strict=True)):
        # The fit counts its delay in deviations of the prior, a knot counts in seconds.
        over_delay = sp.diags_array(J[:, _FORCE_DELAY] / problem.delay_prior)
        derivatives = sp.csr_array(over_delay @ _make_knot_weights(len(r), piece.excitation.rate))
        rows = np.zeros((len(unknowns), derivatives.shape[1]))
        rows[problem.find_columns(i)] = (derivatives.T @ J).T
        information.append((derivatives.T @ derivatives).toarray())
        cross_information.append(rows)
        gradients.append(derivatives.T @ r)
    return _DriftTerms(block_diag(*information), np.hstack(cross_information), np.concatenate(gradients))


def _make_knot_weights(count: int, rate: float) -> sp.csr_array:
    """Return the weights (count, knots) of the knots in each sample, of which at most two are not zero."""
    time = np.arange(count) / rate
    knots = np.linspace(0.0, time[-1], max(round(time[-1] / _KNOT_SPACING), 1) + 1)
    return sp.csr_array(BSpline.design_matrix(time, np.pad(knots, 1, "edge"), 1))


def _find_likeliest_drift(
    terms: _DriftTerms, H: Array, gradient: Array, interior: BoolArray, clock_deviation: float
) -> float:
    """Return the drift [s] with the largest likelihood of the residuals; 0 if it may be chance.

    The drift is at most the clock deviation [s].
    """
    size, slope = _separate_knots(terms, H, gradient, interior)
    trials = np.concatenate([[0.0], np.geomspace(_MIN_DRIFT, max(clock_deviation, 2.0 * _MIN_DRIFT), _TRIALS)])
    variances = 1.0 + trials[:, None] ** 2 * size
    # Twice the negative log-likelihood, up to terms that do not depend on the drift.
    deviance = np.sum(np.log(variances) + slope**2 / (size * variances), axis=1)
    best = int(np.argmin(deviance))
    return float(trials[best]) if deviance[0] - deviance[best] > _MIN_LIKELIHOOD_GAIN else 0.0


def _separate_knots(terms: _DriftTerms, H: Array, gradient: Array, interior: BoolArray) -> tuple[Array, Array]:
    """Return information and gradient over the knots, (M,) each, with the unknowns fitted along.

    Along the eigenvectors the knots are independent, so one decomposition serves every trial.
    """
    shared = terms.cross_information[interior]
    solved = np.linalg.solve(H, np.column_stack([shared, gradient]))
    size, vectors = np.linalg.eigh(terms.information - shared.T @ solved[:, :-1])
    informative = size > _MIN_INFORMATION * size[-1]
    return size[informative], (vectors.T @ (terms.gradient - shared.T @ solved[:, -1]))[informative]
