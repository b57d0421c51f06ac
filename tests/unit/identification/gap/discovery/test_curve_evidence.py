"""Evidence for a curve: it is the marginal likelihood of a linear model, without what the law can take up."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from identification.fitting import Evaluation
from identification.gap.discovery.curve_evidence import _DEVIATIONS, compute_curve_evidence

LAW, CURVE = slice(0, 4), slice(4, 10)
SAMPLES = 40


def make_model(seed, coefficients=0.0, noise=1.0):
    """Return sensitivities (N, U) of a law and a curve, and an error (N,) of which the curve is a part."""
    random = default_rng(seed)
    J = random.standard_normal((SAMPLES, CURVE.stop))
    J[:, CURVE] += J[:, LAW] @ random.standard_normal((4, 6))
    truth = coefficients * random.standard_normal(6)
    return J, J[:, LAW] @ random.standard_normal(4) + J[:, CURVE] @ truth + noise * random.standard_normal(SAMPLES)


def compute(J, error, free=None, low=-np.inf):
    """Return the evidence, from the cost of an error (N,) whose negative is the residual."""
    here = Evaluation(float(error @ error), J.T @ J, -J.T @ error)
    mask = np.ones(J.shape[1], bool) if free is None else free
    bounds = np.broadcast_to(low, J.shape[1]), np.full(J.shape[1], np.inf)
    problem = SimpleNamespace(free_mask=mask, samples=len(error), get_bounds=lambda: bounds)
    return compute_curve_evidence(problem, here, np.zeros(J.shape[1]), CURVE)


def estimate_variance(J, error):
    """Return the variance of what law and curve leave; the noise of the problem is one."""
    left = error - J @ np.linalg.lstsq(J, error, rcond=None)[0]
    return max(float(left @ left) / len(error), 1.0)


def compute_dense_log_odds(J, error, deviation, variance):
    """Return the log odds from the densities of the error outside the span of the law."""
    outside = null_space(J[:, LAW].T).T
    y, B = outside @ error, outside @ J[:, CURVE]
    noise = variance * np.eye(len(y))
    curve = multivariate_normal(np.zeros(len(y)), noise + deviation**2 * B @ B.T).logpdf(y)
    return float(curve - multivariate_normal(np.zeros(len(y)), noise).logpdf(y))


@pytest.mark.parametrize(("coefficients", "noise"), [(0.3, 1.0), (1.0, 3.0), (5.0, 1.0), (0.0, 2.0)])
def test_log_odds_are_those_of_the_marginal_likelihood(coefficients, noise):
    J, error = make_model(1, coefficients, noise)
    variance = estimate_variance(J, error)
    dense = [compute_dense_log_odds(J, error, s, variance) for s in _DEVIATIONS]
    found = compute(J, error)
    assert found.log_odds == pytest.approx(max(dense), rel=1e-5, abs=1e-6)
    # The deviation is relative to the noise that is left, as in a fit.
    assert found.deviation == pytest.approx(_DEVIATIONS[int(np.argmax(dense))] / np.sqrt(variance))


def test_the_step_is_that_of_the_most_probable_curve():
    J, error = make_model(2, 0.5)
    found = compute(J, error)
    variance = estimate_variance(J, error)
    prior = np.zeros(J.shape[1])
    prior[CURVE] = 1.0 / found.deviation**2  # over the noise of the problem: the variance cancels
    direct = np.linalg.solve(J.T @ J + np.diag(prior), J.T @ error)
    np.testing.assert_allclose(found.step, direct, rtol=1e-4, atol=1e-6)
    assert variance < 1.5


def test_an_unknown_whose_step_would_leave_its_bound_is_held():
    J, error = make_model(3, 0.5)
    outside = int(np.argmin(compute(J, error).step[LAW]))
    low, free = np.full(J.shape[1], -np.inf), np.ones(J.shape[1], bool)
    low[outside] = 0.0
    found = compute(J, error, low=low)
    assert compute(J, error).step[outside] < 0.0
    assert found.step[outside] == 0.0
    free[outside] = False
    assert found.log_odds == pytest.approx(compute(J, error, free=free).log_odds)


def test_a_bound_does_not_hold_an_unknown_that_moves_inside():
    J, error = make_model(3, 0.5)
    inside = int(np.argmax(compute(J, error).step[LAW]))
    low = np.full(J.shape[1], -np.inf)
    low[inside] = 0.0
    np.testing.assert_allclose(compute(J, error, low=low).step, compute(J, error).step)


def test_an_unknown_that_is_not_free_stays_and_takes_nothing_up():
    J, error = make_model(3, 0.5)
    free = np.ones(J.shape[1], bool)
    free[1] = False
    found = compute(J, error, free=free)
    assert found.step[1] == 0.0
    without = np.delete(J, 1, axis=1)
    here = Evaluation(float(error @ error), without.T @ without, -without.T @ error)
    bounds = np.full(9, -np.inf), np.full(9, np.inf)
    problem = SimpleNamespace(free_mask=np.ones(9, bool), samples=SAMPLES, get_bounds=lambda: bounds)
    other = compute_curve_evidence(problem, here, np.zeros(9), slice(3, 9))
    assert found.log_odds == pytest.approx(other.log_odds)


def test_noise_is_no_evidence():
    odds = np.array([compute(*make_model(seed)).log_odds for seed in range(60)])
    assert np.median(odds) < 0.5
    assert odds.max() < 6.0
    assert compute(*make_model(0, 1.0)).log_odds > 30.0


@pytest.mark.parametrize("size", [1.0, 100.0])
def test_what_the_law_takes_up_is_no_evidence(size):
    J, error = make_model(4)
    J[:, CURVE] = J[:, LAW] @ default_rng(5).standard_normal((4, 6))
    found = compute(J, error + size * J[:, 6])
    assert abs(found.log_odds) < 1e-3
    assert np.abs(J @ found.step - J @ np.linalg.lstsq(J, error + size * J[:, 6], rcond=None)[0]).max() < 1e-3


def test_the_noise_is_what_the_curve_leaves_and_no_less_than_that_of_the_problem():
    J, error = make_model(6, 2.0, noise=4.0)
    once = compute(J, error)
    # In other units of the noise, odds and curve are the same, as long as more than the noise is left.
    finer = compute(8.0 * J, 8.0 * error)
    assert finer.log_odds == pytest.approx(once.log_odds, rel=1e-6)
    np.testing.assert_allclose(finer.step, once.step, rtol=1e-6, atol=1e-9)
    assert compute(J / 40.0, error / 40.0).log_odds < 0.5 * once.log_odds
