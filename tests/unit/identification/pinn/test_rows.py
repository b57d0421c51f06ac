"""Analytic Jacobians against finite differences, and the elimination against the whole system at once."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from made_up_problem import TRUTH, network_on, problem
from numpy.random import default_rng

from identification.pinn import law_rows
from identification.pinn.batches import learned
from identification.pinn.elimination import NodePrior, factorise
from identification.pinn.global_loss import GlobalLoss, Recorded, Samples
from identification.pinn.local_rows import LocalLoss, Weights
from identification.pinn.mesh import Heads
from identification.pinn.mlp import Network
from identification.pinn.quadrature import gauss_points
from identification.problem import COORDINATE_COUNT

STEP = 1e-6
UNKNOWNS = COORDINATE_COUNT + 2
FAR = np.full(UNKNOWNS, np.inf)


def shared_unknowns(given, seed=0):
    """Search numbers beside the truth, and delays that are not zero."""
    q = given.space.to_search(TRUTH) + 0.1 * default_rng(seed).standard_normal(13)
    return np.concatenate([q, [0.3, -0.2]])


def random_heads(like: Heads, seed=5) -> Heads:
    random = default_rng(seed)
    parts = (like.node_z, like.node_y, like.inner_z, like.inner_y)
    return Heads(*(random.standard_normal(p.shape) for p in parts))


@pytest.mark.parametrize("residual", ["points", "means", "weak"])
@pytest.mark.parametrize("low_pass", [False, True], ids=["plain", "behind a filter"])
def test_rows_of_the_local_network_have_the_slopes_of_finite_differences(low_pass, residual):
    given = problem((0.0, 0.4), 0.8, low_pass=low_pass)
    network, loss = network_on(given, residual=residual)
    assert isinstance(loss, LocalLoss)
    unknowns, weights = shared_unknowns(given), Weights(7.0, given.noise)
    pull = loss.rows(unknowns, network.heads, weights, slopes=False)
    along, step = random_heads(network.heads), default_rng(9).standard_normal(UNKNOWNS)
    rows = loss.rows(unknowns, network.heads, weights, pull, slopes=True)
    high, low = (
        loss.rows(unknowns + s * step, network.heads.moved(along, s), weights, pull, slopes=False)
        for s in (STEP, -STEP)
    )
    for batch, row, above, below in zip(loss.batches, rows, high, low, strict=True):
        shared = np.tile(step, (len(batch.left), 1))
        direction = np.hstack([*along.of(batch.left, batch.elements), shared])
        expected = (above.all - below.all) / (2 * STEP)
        found = (row.slopes @ direction[..., None])[..., 0]
        assert found == pytest.approx(expected, rel=2e-5, abs=1e-6 * np.abs(expected).max())


def test_multipliers_add_the_residuals_of_the_law_and_leave_the_force_alone():
    given = problem((0.0, 0.4), 0.8)
    network, loss = network_on(given)
    unknowns, weights = shared_unknowns(given), Weights(7.0, given.noise)
    plain = loss.rows(unknowns, network.heads, weights, slopes=False)
    pulled = loss.rows(unknowns, network.heads, weights, plain, slopes=False)
    for name in ("hysteresis", "balance"):
        before, after = getattr(plain[0], name), getattr(pulled[0], name)
        assert np.array_equal(after[:, :-1], 2 * before[:, :-1])
        assert np.array_equal(after[:, -1], before[:, -1]), "a test that no head is left for"
    assert np.array_equal(pulled[0].misfit, plain[0].misfit)


def test_the_law_is_asked_for_in_as_many_ways_as_an_element_has_heads_of_its_own():
    network, loss = network_on(problem((0.0, 0.4), 0.8))
    batch = loss.batches[0]
    rank = batch.values.shape[1]
    weight = np.sqrt(gauss_points(len(batch.values))[1])[:, None]
    slopes = weight * network.layer.slopes(gauss_points(len(batch.values))[0])
    met = batch.tests[:, :-1]
    assert met.shape[1] == rank - 1
    assert met.T @ met == pytest.approx(np.eye(rank - 1), abs=1e-9)
    unasked = np.linalg.norm(slopes - met @ (met.T @ slopes), 2)
    assert unasked <= 1.001 * np.linalg.svd(slopes)[1][-1], "only the least of the slopes is left out"
    assert met.T @ batch.tests[:, -1] == pytest.approx(np.zeros(rank - 1), abs=1e-9)
    assert np.linalg.norm(batch.asked[:, -1]) < 0.2
    assert np.array_equal(batch.asked[:, :-1], met)


def whole_system(rows, batches, network, priors):
    """Every row over every weight and shared unknown, with the pulls that the elimination adds."""
    mesh, count = network.mesh, network.heads.inner_z.shape[1]
    nodes, total = 2 * mesh.nodes, 2 * mesh.nodes + 2 * count * len(mesh.elements)
    tables, rights = [], []
    for batch, row in zip(batches, rows, strict=True):
        for k, number in enumerate(batch.elements.tolist()):
            left, inner = int(batch.left[k]), nodes + 2 * count * number
            z = [2 * left, 2 * left + 2, *range(inner, inner + count)]
            y = [2 * left + 1, 2 * left + 3, *range(inner + count, inner + 2 * count)]
            table = np.zeros((row.all.shape[1], total + UNKNOWNS))
            table[:, z + y + list(range(total, total + UNKNOWNS))] = row.slopes[k]
            tables.append(table)
            rights.append(-row.all[k])
            ridge = np.zeros((2 * count + 4, total + UNKNOWNS))
            ridge[np.arange(2 * count + 4), z + y] = 1e-6
            tables.append(ridge)
            rights.append(np.zeros(len(ridge)))
    for piece, prior in enumerate(priors):
        first = mesh.elements[int(mesh.of_piece(piece)[0])].left
        row = np.zeros((1, total + UNKNOWNS))
        row[0, 2 * first + 1] = 1.0 / prior.deviation
        tables.append(row)
        rights.append([(prior.centre - float(network.heads.node_y[first])) / prior.deviation])
    return np.vstack(tables), np.concatenate(rights), total


def test_elimination_takes_the_same_step_as_the_whole_system():
    given = problem((0.0, 0.4), 0.5, pieces=2)
    network, loss = network_on(given, rank=8, points=10)
    priors = [NodePrior(0.5, 4.0), NodePrior(-0.5, 3.0)]
    rows = loss.rows(shared_unknowns(given), network.heads, Weights(3.0, given.noise), slopes=True)
    found = factorise(rows, loss.batches, network.mesh, network.heads, priors)
    J, right, total = whole_system(rows, loss.batches, network, priors)
    damping = np.full(UNKNOWNS, 0.01)
    held = np.zeros((UNKNOWNS, total + UNKNOWNS))
    held[:, total:] = np.diag(np.sqrt(damping))
    expected = np.linalg.lstsq(np.vstack([J, held]), np.concatenate([right, np.zeros(UNKNOWNS)]), rcond=None)[0]
    step = found.step(np.ones(UNKNOWNS, bool), damping, -FAR, FAR)
    assert step == pytest.approx(expected[total:], rel=1e-6, abs=1e-9)
    heads = found.heads(step, network.mesh, loss.batches)
    nodes = expected[: 2 * network.mesh.nodes].reshape(-1, 2)
    assert heads.node_z == pytest.approx(nodes[:, 0], rel=1e-5, abs=1e-7)
    assert heads.node_y == pytest.approx(nodes[:, 1], rel=1e-5, abs=1e-7)
    inner = expected[2 * network.mesh.nodes : total].reshape(len(network.mesh.elements), 2, -1)
    weighted = np.abs(inner).max()
    assert heads.inner_z == pytest.approx(inner[:, 0], rel=1e-4, abs=1e-6 * weighted)
    assert heads.inner_y == pytest.approx(inner[:, 1], rel=1e-4, abs=1e-6 * weighted)


def test_a_held_unknown_does_not_move_and_the_others_step_as_if_it_were_not_there():
    given = problem((0.0, 0.4), 0.5)
    network, loss = network_on(given, rank=8, points=10)
    priors = [NodePrior(0.0, 4.0)]
    rows = loss.rows(shared_unknowns(given), network.heads, Weights(3.0, given.noise), slopes=True)
    found = factorise(rows, loss.batches, network.mesh, network.heads, priors)
    free = np.ones(UNKNOWNS, bool)
    free[4] = False
    step = found.step(free, np.zeros(UNKNOWNS), -FAR, FAR)
    J, right, total = whole_system(rows, loss.batches, network, priors)
    expected = np.linalg.lstsq(np.delete(J, total + 4, 1), right, rcond=None)[0][total:]
    assert step[4] == 0.0
    assert np.delete(step, 4) == pytest.approx(expected, rel=1e-5, abs=1e-8)


def test_an_unknown_at_its_edge_stays_there_and_the_others_take_the_step_that_goes_with_it():
    given = problem((0.0, 0.4), 0.5)
    network, loss = network_on(given, rank=8, points=10)
    rows = loss.rows(shared_unknowns(given), network.heads, Weights(3.0, given.noise), slopes=True)
    found = factorise(rows, loss.batches, network.mesh, network.heads, [NodePrior(0.0, 4.0)])
    every, none = np.ones(UNKNOWNS, bool), np.zeros(UNKNOWNS)
    wanted = found.step(every, none, -FAR, FAR)
    low, high = -FAR.copy(), FAR.copy()
    (low if wanted[3] < 0 else high)[3] = 0.4 * wanted[3]
    bounded = found.step(every, none, low, high)
    assert bounded[3] == pytest.approx(0.4 * wanted[3])
    J, right = found.triangle[:, :-1], found.triangle[:, -1]
    gradient = J.T @ (J @ bounded - right)
    assert np.delete(gradient, 3) == pytest.approx(np.zeros(UNKNOWNS - 1), abs=1e-6 * np.abs(J.T @ right).max())


def test_information_is_that_of_the_shared_unknowns_with_the_heads_marginalised():
    given = problem((0.0, 0.4), 0.5)
    network, loss = network_on(given, rank=8, points=10)
    priors = [NodePrior(0.0, 4.0)]
    rows = loss.rows(shared_unknowns(given), network.heads, Weights(3.0, given.noise), slopes=True)
    found = factorise(rows, loss.batches, network.mesh, network.heads, priors).information()
    J, _, total = whole_system(rows, loss.batches, network, priors)
    Q, _ = np.linalg.qr(J[:, :total])
    rest = J[:, total:] - Q @ (Q.T @ J[:, total:])
    assert found == pytest.approx(rest.T @ rest, rel=1e-5, abs=1e-6 * np.abs(rest.T @ rest).max())


def global_samples(given, inputs=5, dampers=1):
    random = default_rng(2)
    source = learned(given)[0]
    time = np.sort(random.uniform(0.05, source.inputs.duration - 0.05, (dampers, 40)))
    x, v = source.inputs.motion(time)
    shown = random.standard_normal((2, dampers, 40, inputs))
    made = (*shown, x, v, 100 * v, np.ones_like(x), np.ones_like(x))
    return Samples(np.zeros(time.shape, np.int64), time, *map(torch.as_tensor, made))


def test_rows_of_the_global_network_have_the_slopes_of_finite_differences_for_each_damper_of_a_batch():
    given = (problem((0.0, 0.4), 0.8), problem((0.0, 0.3), 0.8, seed=4))
    samples, network = global_samples(given[0], dampers=2), Network([5, 6, 6, 2])
    loss = GlobalLoss([Recorded(one, learned(one)) for one in given], network)
    weights = torch.stack([network.begin(seed, "cpu") for seed in (1, 2)])
    q = np.array([shared_unknowns(one, seed)[:13] for seed, one in enumerate(given)])
    random = default_rng(3)
    along, step = torch.as_tensor(random.standard_normal((2, network.count))), random.standard_normal((2, 13))
    rows, J = loss.linearised(samples, weights, q, 4.0)
    assert torch.equal(rows, loss.rows(samples, weights, q, 4.0))
    high, low = (loss.rows(samples, weights + s * along, q + s * step, 4.0) for s in (STEP, -STEP))
    expected = ((high - low) / (2 * STEP)).numpy()
    found = (J @ torch.cat([along, torch.as_tensor(step)], 1)[..., None])[..., 0].numpy()
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())


def test_the_law_of_the_rows_vanishes_on_a_solution_of_the_law():
    slip, z, n = np.array([0.02, -0.03]), np.array([0.4, -0.8]), TRUTH.n
    bend = TRUTH.rho * slip * np.abs(z) + (1 - TRUTH.rho) * np.abs(slip) * z
    rate = (slip - bend * np.abs(z) ** (n - 1)) / TRUTH.D_y
    values = TRUTH._asdict() | {"z": z, "z_rate": rate, "y_rate": 0.01 - slip, "v": 0.01}
    assert law_rows.hysteresis(values) == pytest.approx([0.0, 0.0], abs=1e-12)
    y, y_rate, u, x, v = 1e-3, 0.01 - slip, np.array([0.1, 0.4]), 0.004, 0.01
    both = TRUTH.c0_a + TRUTH.c1_a + (TRUTH.c0_b + TRUTH.c1_b) * u
    forces = (TRUTH.F_a + TRUTH.F_b * u) * z + TRUTH.k0 * (x - y) + (TRUTH.c0_a + TRUTH.c0_b * u) * v
    values |= {"u": u, "x": x, "y": y, "v": v, "y_rate": forces / both}
    assert law_rows.balance(values) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert law_rows.balance(values | {"y_rate": y_rate}) == pytest.approx(both * y_rate - forces)


def test_roughness_that_no_function_of_the_element_can_follow_is_asked_of_nobody():
    given = problem((0.3,), 1.5)
    network, loss = network_on(given)
    unknowns, weights = shared_unknowns(given), Weights(7.0, given.noise)
    b = loss.batches[0]
    rough = default_rng(4).standard_normal(b.motion[1].shape)
    rough = (rough - (rough @ b.tests) @ b.tests.T) / b.share
    rougher = LocalLoss(given, [replace(b, motion=(b.motion[0], b.motion[1] + rough))], 0.0)
    plain = LocalLoss(given, [b], 0.0)
    before, after = (
        one.rows(unknowns, network.heads, weights, slopes=False)[0].balance for one in (plain, rougher)
    )
    assert after == pytest.approx(before, rel=1e-9, abs=1e-7 * np.abs(before).max())
    smooth = LocalLoss(given, [replace(b, motion=(b.motion[0], b.motion[1] + 0.01))], 0.0)
    moved = smooth.rows(unknowns, network.heads, weights, slopes=False)[0].balance
    assert np.abs(moved - before).max() > 1.0
