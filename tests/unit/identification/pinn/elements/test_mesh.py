"""Meshes of the network of elements, and its states on them."""

import numpy as np
import pytest

from identification.pinn.common.initialisation import InitialStates
from identification.pinn.common.time_map import make_linear_map
from identification.pinn.elements.mesh import make_mesh
from identification.pinn.elements.quadrature import compute_gauss_points
from tests.support.pinn_problem import RATE, TRUTH, make_network, make_problem

STEP = 1e-6


def test_elements_join_without_gaps_and_begin_at_each_drive_step():
    network, _ = make_network(make_problem())
    elements = network.mesh.elements
    assert [a.end for a in elements[:-1]] == pytest.approx([b.start for b in elements[1:]], abs=1e-12)
    assert [b.left_node for b in elements] == list(range(len(elements)))
    assert elements[0].start == pytest.approx(0.020)
    assert elements[-1].end == pytest.approx((4500 - 1) / RATE)
    for step in (1.5, 3.0):
        assert min(abs(e.start - step) for e in elements) < 1e-9


def test_states_are_continuous_at_the_nodes():
    network, _ = make_network(make_problem())
    starts = np.array([e.start for e in network.mesh.elements[1:]])
    before, after = network.evaluate_states(0, starts - 1e-9), network.evaluate_states(0, starts + 1e-9)
    assert before.z == pytest.approx(after.z, abs=1e-4)
    assert before.y == pytest.approx(after.y, abs=1e-8)


def test_the_inner_velocity_is_the_rate_of_the_inner_displacement():
    network, _ = make_network(make_problem())
    time = np.linspace(0.1, 4.4, 57)
    rate = (network.evaluate_states(0, time + STEP).y - network.evaluate_states(0, time - STEP).y) / (2 * STEP)
    assert rate == pytest.approx(network.evaluate_states(0, time).y_rate, rel=1e-5, abs=1e-7)


def test_elements_with_plain_time_have_the_reversals_of_the_slip():
    network, loss = make_network(make_problem())
    source = loss.batches[0].source
    slip = InitialStates(source, TRUTH).make_slip_velocity()
    mesh = make_mesh(
        [source.inputs], [source.span], [slip], TRUTH.D_y, TRUTH.eta, [0.0], follow_breakthrough=False
    )
    for plain, mapped in zip(mesh.elements, network.mesh.elements, strict=True):
        assert (plain.start, plain.slip_velocity) == (mapped.start, mapped.slip_velocity)
        assert plain.time_map == make_linear_map(mapped.time_map.length)


def test_a_new_mesh_moves_with_the_slip_and_keeps_the_states():
    network, loss = make_network(make_problem(), rank=24, points=40)
    source = loss.batches[0].source

    def delayed_velocity(time):
        return source.inputs.evaluate_motion(time - 0.003)[1]

    mesh = make_mesh([source.inputs], [source.span], [delayed_velocity], TRUTH.D_y, TRUTH.eta, [0.0])
    assert mesh.measure_shift(network.mesh) > 1e-3
    moved = network.refit(mesh, network.evaluate_states, compute_gauss_points(40)[0])
    time = np.linspace(0.1, 4.4, 500)
    assert moved.evaluate_states(0, time).y == pytest.approx(network.evaluate_states(0, time).y, abs=5e-5)
