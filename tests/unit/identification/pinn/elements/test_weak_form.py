"""The weak form (a research option): derivative table, and comparison with the Galerkin form."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import polynomial
from numpy.random import default_rng

from identification.pinn.elements.hidden_layer import HiddenLayer
from identification.pinn.elements.quadrature import compute_gauss_points, make_weak_derivative
from identification.pinn.elements.residuals import LossWeights
from tests.support.pinn_problem import TRUTH, make_network, make_problem

FINE = {"rank": 24, "points": 60}


def compute_law_residuals(problem, weighting, **sizes):
    """Return the weighted residuals of eqs. 3 and 4 for initial states, element by element."""
    network, loss = make_network(problem, weighting=weighting, **sizes)
    unknowns = np.concatenate([problem.space.to_search(TRUTH), [0.0, 0.0]])
    residuals = loss.compute_weighted_residuals(
        unknowns, network.output_weights, LossWeights(5.0, problem.noise), jacobian=False
    )
    return [np.vstack([r.hysteresis for r in residuals]), np.vstack([r.balance for r in residuals])]


def roughen(problem, size):
    """Return the problem with noise of ``size`` [m/s] on the velocity, and unchanged displacements."""
    (piece,) = problem.pieces
    noise = size * default_rng(6).standard_normal(len(piece.force))
    excitation = replace(piece.excitation, velocity=piece.excitation.velocity + noise)
    return replace(problem, pieces=(replace(piece, excitation=excitation),))


def test_an_integral_with_a_derivative_follows_from_the_values_alone():
    places, table = make_weak_derivative(12)
    points, weights = compute_gauss_points(12)
    values = default_rng(1).standard_normal(len(places))
    fine, fine_weights = compute_gauss_points(48)
    assert places[1:-1] == pytest.approx(fine)
    for degree in (0, 1, 5, 11):
        g = default_rng(degree).standard_normal(degree + 1)
        ends = polynomial.polyval(np.array([0.0, 1.0]), g) @ [-values[0], values[-1]]
        inner = fine_weights @ (polynomial.polyval(fine, polynomial.polyder(g)) * values[1:-1])
        integral = weights @ (polynomial.polyval(points, g) * (values @ table))
        assert integral == pytest.approx(ends - inner, rel=1e-9, abs=1e-9)


def test_derivatives_of_a_smooth_function_are_its_own():
    places, table = make_weak_derivative(30)
    points, _ = compute_gauss_points(30)
    assert np.tanh(4.0 * places - 1.0) @ table == pytest.approx(4.0 / np.cosh(4.0 * points - 1.0) ** 2, abs=1e-7)


def test_rates_of_the_states_are_the_same_after_integration_by_parts():
    layer = HiddenLayer(40, 10, 1)
    places, table = make_weak_derivative(100)
    slopes = layer.differentiate(compute_gauss_points(100)[0])
    assert table.T @ layer.evaluate(places) == pytest.approx(slopes, abs=1e-8 * np.abs(slopes).max())


def test_on_a_smooth_motion_the_weak_form_is_the_galerkin_form_up_to_rounding():
    problem = make_problem((0.0, 0.4), 0.8)
    residuals = (compute_law_residuals(problem, weighting, **FINE) for weighting in ("galerkin", "weak_form"))
    for galerkin, weak in zip(*residuals, strict=True):
        assert np.abs(galerkin).max() > 1.0
        assert weak == pytest.approx(galerkin, abs=1e-5 * np.abs(galerkin).max())


def test_the_velocity_of_the_weak_form_integrates_to_the_displacement_even_if_it_is_noisy():
    problem = roughen(make_problem((0.3,), 1.5), 0.05)
    errors = {}
    for weighting in ("galerkin", "weak_form"):
        network, loss = make_network(problem, weighting=weighting, **FINE)
        nodes, weights = compute_gauss_points(FINE["points"])
        differences = []
        for b in loss.batches:
            elements = [network.mesh.elements[k] for k in b.elements]
            seconds = np.stack([weights / e.time_map.evaluate(e.time_map.invert(nodes))[1] for e in elements])
            x = [b.source.inputs.evaluate_motion(np.array([e.start, e.end]))[0] for e in elements]
            differences.append((b.motion[1] * seconds).sum(1) - np.diff(x)[:, 0])
        errors[weighting] = np.abs(np.concatenate(differences)).max()
    assert errors["weak_form"] < 1e-12
    assert errors["galerkin"] > 1e-5


def test_collocation_has_a_residual_at_each_point():
    problem = make_problem((0.0, 0.4), 0.8)
    network, loss = make_network(problem, weighting="collocation")
    assert np.array_equal(loss.batches[0].weighted_tests, np.eye(14))
    for residuals in compute_law_residuals(problem, "collocation"):
        assert residuals.shape == (len(network.mesh.elements), 14)
