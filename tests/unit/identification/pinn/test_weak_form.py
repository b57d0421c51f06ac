"""The law without the stroke's velocity: what integrating by parts changes, and what it leaves as it was."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_problem import TRUTH, network_on, problem
from numpy.polynomial import polynomial
from numpy.random import default_rng

from identification.pinn.hidden_layer import HiddenLayer
from identification.pinn.local_rows import Weights
from identification.pinn.quadrature import gauss_points, slopes_by_parts

FINE = {"rank": 24, "points": 60}


def law(given, residual, **sizes):
    """Rows of eqs. 3 and 4 with the states of the beginning, element by element."""
    network, loss = network_on(given, residual=residual, **sizes)
    unknowns = np.concatenate([given.space.to_search(TRUTH), [0.0, 0.0]])
    rows = loss.rows(unknowns, network.heads, Weights(5.0, given.noise), slopes=False)
    return [np.vstack([r.hysteresis for r in rows]), np.vstack([r.balance for r in rows])]


def rough(given, size):
    """The same displacement at the samples, with a velocity that is noisy by ``size`` [m/s]."""
    (piece,) = given.pieces
    noise = size * default_rng(6).standard_normal(len(piece.force))
    stroke = replace(piece.stroke, velocity=piece.stroke.velocity + noise)
    return replace(given, pieces=(replace(piece, stroke=stroke),))


def test_an_integral_with_a_slope_is_had_from_the_values_alone():
    places, table = slopes_by_parts(12)
    points, weights = gauss_points(12)
    jumping = default_rng(1).standard_normal(len(places))
    fine, fine_weights = gauss_points(48)
    assert places[1:-1] == pytest.approx(fine)
    for degree in (0, 1, 5, 11):
        g = default_rng(degree).standard_normal(degree + 1)
        ends = polynomial.polyval(np.array([0.0, 1.0]), g) @ [-jumping[0], jumping[-1]]
        inner = fine_weights @ (polynomial.polyval(fine, polynomial.polyder(g)) * jumping[1:-1])
        found = weights @ (polynomial.polyval(points, g) * (jumping @ table))
        assert found == pytest.approx(ends - inner, rel=1e-9, abs=1e-9)


def test_slopes_of_what_is_smooth_are_its_own():
    places, table = slopes_by_parts(30)
    points, _ = gauss_points(30)
    assert np.tanh(4.0 * places - 1.0) @ table == pytest.approx(4.0 / np.cosh(4.0 * points - 1.0) ** 2, abs=1e-7)


def test_the_rates_of_the_states_are_the_same_by_parts_to_rounding():
    layer = HiddenLayer(40, 10, 1)
    places, table = slopes_by_parts(100)
    slopes = layer.slopes(gauss_points(100)[0])
    assert table.T @ layer.values(places) == pytest.approx(slopes, abs=1e-8 * np.abs(slopes).max())


def test_on_a_smooth_motion_the_weak_law_is_the_law_in_the_mean_to_rounding():
    given = problem((0.0, 0.4), 0.8)
    for means, weak in zip(*(law(given, one, **FINE) for one in ("means", "weak")), strict=True):
        assert np.abs(means).max() > 1.0
        assert weak == pytest.approx(means, abs=1e-5 * np.abs(means).max())


def test_the_velocity_of_the_weak_law_adds_up_to_the_way_travelled_however_noisy_it_is():
    given = rough(problem((0.3,), 1.5), 0.05)
    missed = {}
    for residual in ("means", "weak"):
        network, loss = network_on(given, residual=residual, **FINE)
        nodes, weights = gauss_points(FINE["points"])
        ways = []
        for b in loss.batches:
            elements = [network.mesh.elements[k] for k in b.elements]
            seconds = np.stack([weights / e.memory.at(e.memory.time(nodes))[1] for e in elements])
            x = [b.source.inputs.motion(np.array([e.start, e.end]))[0] for e in elements]
            ways.append((b.motion[1] * seconds).sum(1) - np.diff(x)[:, 0])
        missed[residual] = np.abs(np.concatenate(ways)).max()
    assert missed["weak"] < 1e-12
    assert missed["means"] > 1e-5


def test_at_points_there_is_a_row_for_each_of_them():
    given = problem((0.0, 0.4), 0.8)
    network, loss = network_on(given, residual="points")
    assert np.array_equal(loss.batches[0].asked, np.eye(14))
    for rows in law(given, "points"):
        assert rows.shape == (len(network.mesh.elements), 14)
