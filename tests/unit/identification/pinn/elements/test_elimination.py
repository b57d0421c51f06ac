"""Elimination of the output weights, against the whole least-squares system."""

import numpy as np
import pytest

from identification.fitting.unknown_layout import COORDINATE_COUNT
from identification.pinn.elements.elimination import NodePrior, factorise
from identification.pinn.elements.residuals import LossWeights
from tests.support.pinn_problem import make_network, make_problem, make_unknowns

UNKNOWNS = COORDINATE_COUNT + 2
FAR = np.full(UNKNOWNS, np.inf)


def linearise(priors, pieces=1):
    """Return network, weighted residuals, batches and factorisation of a small problem."""
    problem = make_problem((0.0, 0.4), 0.5, pieces=pieces)
    network, loss = make_network(problem, rank=8, points=10)
    residuals = loss.compute_weighted_residuals(
        make_unknowns(problem), network.output_weights, LossWeights(3.0, problem.noise), jacobian=True
    )
    factorisation = factorise(residuals, loss.batches, network.mesh, network.output_weights, priors)
    return network, residuals, loss.batches, factorisation


def assemble_system(residuals, batches, network, priors):
    """Return all residuals over weights and shared unknowns, with ridge and priors of the elimination."""
    mesh, count = network.mesh, network.output_weights.inner_z.shape[1]
    nodes, total = 2 * mesh.node_count, 2 * mesh.node_count + 2 * count * len(mesh.elements)
    tables, rights = [], []
    for batch, batch_residuals in zip(batches, residuals, strict=True):
        for k, number in enumerate(batch.elements.tolist()):
            left, inner = int(batch.left_node[k]), nodes + 2 * count * number
            z = [2 * left, 2 * left + 2, *range(inner, inner + count)]
            y = [2 * left + 1, 2 * left + 3, *range(inner + count, inner + 2 * count)]
            table = np.zeros((batch_residuals.vector.shape[1], total + UNKNOWNS))
            table[:, z + y + list(range(total, total + UNKNOWNS))] = batch_residuals.jacobian[k]
            tables.append(table)
            rights.append(-batch_residuals.vector[k])
            ridge = np.zeros((2 * count + 4, total + UNKNOWNS))
            ridge[np.arange(2 * count + 4), z + y] = 1e-6
            tables.append(ridge)
            rights.append(np.zeros(len(ridge)))
    for piece, prior in enumerate(priors):
        first = mesh.elements[int(mesh.find_elements(piece)[0])].left_node
        row = np.zeros((1, total + UNKNOWNS))
        row[0, 2 * first + 1] = 1.0 / prior.deviation
        tables.append(row)
        rights.append([(prior.centre - float(network.output_weights.node_y[first])) / prior.deviation])
    return np.vstack(tables), np.concatenate(rights), total


def test_the_step_is_that_of_the_whole_system():
    priors = [NodePrior(0.5, 4.0), NodePrior(-0.5, 3.0)]
    network, residuals, batches, factorisation = linearise(priors, pieces=2)
    J, right, total = assemble_system(residuals, batches, network, priors)
    damping = np.full(UNKNOWNS, 0.01)
    damping_rows = np.zeros((UNKNOWNS, total + UNKNOWNS))
    damping_rows[:, total:] = np.diag(np.sqrt(damping))
    expected = np.linalg.lstsq(
        np.vstack([J, damping_rows]), np.concatenate([right, np.zeros(UNKNOWNS)]), rcond=None
    )[0]
    step = factorisation.solve_step(np.ones(UNKNOWNS, bool), damping, -FAR, FAR)
    assert step == pytest.approx(expected[total:], rel=1e-6, abs=1e-9)
    weights = factorisation.solve_output_weights(step, network.mesh, batches)
    nodes = expected[: 2 * network.mesh.node_count].reshape(-1, 2)
    assert weights.node_z == pytest.approx(nodes[:, 0], rel=1e-5, abs=1e-7)
    assert weights.node_y == pytest.approx(nodes[:, 1], rel=1e-5, abs=1e-7)
    inner = expected[2 * network.mesh.node_count : total].reshape(len(network.mesh.elements), 2, -1)
    largest = np.abs(inner).max()
    assert weights.inner_z == pytest.approx(inner[:, 0], rel=1e-4, abs=1e-6 * largest)
    assert weights.inner_y == pytest.approx(inner[:, 1], rel=1e-4, abs=1e-6 * largest)


def test_a_fixed_unknown_does_not_move_and_the_others_step_as_if_it_did_not_exist():
    priors = [NodePrior(0.0, 4.0)]
    network, residuals, batches, factorisation = linearise(priors)
    free = np.ones(UNKNOWNS, bool)
    free[4] = False
    step = factorisation.solve_step(free, np.zeros(UNKNOWNS), -FAR, FAR)
    J, right, total = assemble_system(residuals, batches, network, priors)
    expected = np.linalg.lstsq(np.delete(J, total + 4, 1), right, rcond=None)[0][total:]
    assert step[4] == 0.0
    assert np.delete(step, 4) == pytest.approx(expected, rel=1e-5, abs=1e-8)


def test_an_unknown_at_its_bound_stays_there_and_the_others_take_the_step_that_belongs_to_it():
    *_, factorisation = linearise([NodePrior(0.0, 4.0)])
    free, damping = np.ones(UNKNOWNS, bool), np.zeros(UNKNOWNS)
    unbounded = factorisation.solve_step(free, damping, -FAR, FAR)
    low, high = -FAR.copy(), FAR.copy()
    (low if unbounded[3] < 0 else high)[3] = 0.4 * unbounded[3]
    bounded = factorisation.solve_step(free, damping, low, high)
    assert bounded[3] == pytest.approx(0.4 * unbounded[3])
    J, right = factorisation.triangle[:, :-1], factorisation.triangle[:, -1]
    gradient = J.T @ (J @ bounded - right)
    assert np.delete(gradient, 3) == pytest.approx(np.zeros(UNKNOWNS - 1), abs=1e-6 * np.abs(J.T @ right).max())


def test_the_information_is_that_of_the_shared_unknowns_with_marginalised_output_weights():
    priors = [NodePrior(0.0, 4.0)]
    network, residuals, batches, factorisation = linearise(priors)
    J, _, total = assemble_system(residuals, batches, network, priors)
    Q, _ = np.linalg.qr(J[:, :total])
    remainder = J[:, total:] - Q @ (Q.T @ J[:, total:])
    expected = remainder.T @ remainder
    assert factorisation.compute_information() == pytest.approx(
        expected, rel=1e-5, abs=1e-6 * np.abs(expected).max()
    )
