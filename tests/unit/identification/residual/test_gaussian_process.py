"""Gaussian process with support points, against the exact process and against sums over samples."""

import numpy as np
import pytest

from identification.residual.gaussian_process import Basis, Moments, Posterior, add_moments


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-2.0, 2.0, (60, 2))


def compute_exact(points, values, states, ridge):
    """Return mean and relative variance of the exact Gaussian process."""

    def covariance(a, b):
        return np.exp(-0.5 * ((a[:, None, :] - b) ** 2).sum(axis=2))

    gram = covariance(points, points) + ridge * np.eye(len(points))
    cross = covariance(states, points)
    return cross @ np.linalg.solve(gram, values), 1.0 - np.sum(cross * np.linalg.solve(gram, cross.T).T, axis=1)


def test_with_all_samples_as_support_it_is_the_exact_process(points):
    values = np.sin(points[:, 0]) * points[:, 1]
    states = np.random.default_rng(2).uniform(-2.5, 2.5, (20, 2))
    basis = Basis.make(points)
    posterior = Posterior.make(Moments.make(basis.evaluate(points), values), 0.01)
    mean, variance = compute_exact(points, values, states, 0.01)
    assert basis.evaluate(states) @ posterior.weights == pytest.approx(mean, abs=1e-3)
    assert posterior.compute_variance(basis.evaluate(states)) == pytest.approx(variance, abs=1e-3)


def test_far_from_all_samples_it_is_zero_with_the_variance_of_the_prior(points):
    basis = Basis.make(points)
    posterior = Posterior.make(Moments.make(basis.evaluate(points), np.full(60, 5.0)), 0.01)
    far = basis.evaluate(np.array([[40.0, -40.0]]))
    assert far @ posterior.weights == pytest.approx(0.0, abs=1e-12)
    assert posterior.compute_variance(far) == pytest.approx(1.0)
    assert posterior.compute_variance(basis.evaluate(points)).max() < 0.1


def test_sums_without_a_basis_for_each_state_are_the_same(points):
    basis, values = Basis.make(points[:20]), np.cos(points[:, 0])
    expected, sums = Moments.make(basis.evaluate(points), values), basis.compute_moments(points, values)
    assert sums.gram == pytest.approx(expected.gram, rel=1e-9, abs=1e-9)
    assert sums.moment == pytest.approx(expected.moment, rel=1e-9, abs=1e-9)
    assert sums.square == expected.square


def test_sums_of_conditions_add_and_are_taken_away(points):
    basis = Basis.make(points[:20]).evaluate(points)
    values = np.cos(points[:, 0])
    parts = [Moments.make(basis[:25], values[:25]), Moments.make(basis[25:], values[25:])]
    total, whole = add_moments(parts), Moments.make(basis, values)
    assert total.gram == pytest.approx(whole.gram)
    others = total - parts[0]
    assert others.gram == pytest.approx(parts[1].gram)
    assert (others.moment, others.square) == (pytest.approx(parts[1].moment), pytest.approx(parts[1].square))
    weights = np.linspace(-1.0, 1.0, 20)
    error = np.sum((values - basis @ weights) ** 2)
    assert whole.compute_squared_error(weights) == pytest.approx(error)
