"""Where the elements lie, what their input is, and what the hidden layer can make of it."""

import numpy as np
import pytest
from made_up_problem import RATE, TRUTH, network_on, problem

from identification.pinn.activations import ACTIVATIONS
from identification.pinn.beginning import FirstStates
from identification.pinn.hidden_layer import HiddenLayer
from identification.pinn.inputs import Inputs
from identification.pinn.memory_input import MemoryInput, after_reversal, plain
from identification.pinn.mesh import make_mesh
from identification.pinn.quadrature import gauss_points
from identification.pinn.reversals import reversals, turning_points
from identification.pinn.split import validation_masks
from identification.simulate import Setting, simulate

STEP = 1e-6


def test_the_memory_input_runs_from_nought_to_one_with_its_own_rates():
    memory = MemoryInput(0.3, 0.04, 0.005)
    time = np.linspace(0.01, 0.29, 30)
    value, rate, change = memory.at(time)
    ends, _, _ = memory.at(np.array([0.0, 0.3]))
    assert ends == pytest.approx([0.0, 1.0], abs=1e-12)
    assert memory.time(value) == pytest.approx(time, rel=1e-12)
    later, rate_later, _ = memory.at(time + STEP)
    assert (later - value) / STEP == pytest.approx(rate, rel=1e-3)
    assert (rate_later - rate) / STEP == pytest.approx(change, rel=2e-3, abs=1e-2)


def test_the_memory_input_is_finest_where_the_slip_breaks_through():
    time = np.linspace(0.0, 0.3, 3001)
    slip_velocity = 0.04 * np.sin(np.pi * time / 0.3)
    memory = after_reversal(0.3, time, slip_velocity, 1e-4)
    slip = 0.04 * 0.3 / np.pi * (1 - np.cos(np.pi * time / 0.3))
    assert np.interp(memory.centre, time, slip) == pytest.approx(1.3e-4, rel=1e-2)
    assert time[np.argmax(memory.at(time)[1])] == pytest.approx(memory.centre, abs=2e-4)


def test_a_plain_input_is_time_to_a_hundredth():
    value, rate, _ = plain(0.2).at(np.linspace(0.0, 0.2, 11))
    assert value == pytest.approx(np.linspace(0.0, 1.0, 11), abs=1e-2)
    assert rate == pytest.approx(5.0, rel=0.03)


def test_reversals_are_those_of_the_slip_and_creeping_about_zero_is_none():
    time = np.arange(0.0, 2.0, 1e-3)
    slip_velocity = 0.05 * np.cos(2 * np.pi * time)
    slip_velocity[np.abs(time - 0.25) < 0.02] = 1e-4 * np.sin(400 * time[np.abs(time - 0.25) < 0.02])
    found = reversals(time, slip_velocity, 1e-3)
    assert len(found) == 4
    assert found[1:] == pytest.approx([0.75, 1.25, 1.75], abs=1e-3)
    assert found[0] == pytest.approx(0.25, abs=0.025)


def test_a_turn_is_left_by_more_than_the_threshold():
    assert turning_points(np.array([0.0, 1.0, 0.7, 1.2, -1.0, 0.0, 2.0, 0.0]), 0.5) == [3, 4, 6]


def test_elements_join_without_gaps_and_begin_at_each_step_of_the_drive():
    network, _ = network_on(problem())
    elements = network.mesh.elements
    assert [a.end for a in elements[:-1]] == pytest.approx([b.start for b in elements[1:]], abs=1e-12)
    assert [b.left for b in elements] == list(range(len(elements)))
    assert elements[0].start == pytest.approx(0.020)
    assert elements[-1].end == pytest.approx((4500 - 1) / RATE)
    for step in (1.5, 3.0):
        assert min(abs(e.start - step) for e in elements) < 1e-9


def test_states_are_continuous_at_the_nodes_by_construction():
    network, _ = network_on(problem())
    starts = np.array([e.start for e in network.mesh.elements[1:]])
    before, after = network.at(0, starts - 1e-9), network.at(0, starts + 1e-9)
    assert before.z == pytest.approx(after.z, abs=1e-4)
    assert before.y == pytest.approx(after.y, abs=1e-8)


def test_the_velocity_of_the_network_is_the_rate_of_its_displacement():
    network, _ = network_on(problem())
    time = np.linspace(0.1, 4.4, 57)
    found = (network.at(0, time + STEP).y - network.at(0, time - STEP).y) / (2 * STEP)
    assert found == pytest.approx(network.at(0, time).y_rate, rel=1e-5, abs=1e-7)


def test_an_element_that_is_shown_plain_time_turns_where_the_slip_does():
    given = problem()
    network, loss = network_on(given)
    source = loss.batches[0].source
    slip = FirstStates(source, TRUTH).slip_velocity()
    mesh = make_mesh([source.inputs], [source.span], [slip], TRUTH.D_y, TRUTH.eta, [0.0], stretched=False)
    for bare, full in zip(mesh.elements, network.mesh.elements, strict=True):
        assert (bare.start, bare.slip_velocity) == (full.start, full.slip_velocity)
        assert bare.memory == plain(full.memory.length)


def test_a_new_mesh_moves_with_the_slip_and_keeps_the_states():
    given = problem()
    network, loss = network_on(given, rank=24, points=40)
    sources = [loss.batches[0].source]

    def later(time):
        return sources[0].inputs.motion(time - 0.003)[1]

    mesh = make_mesh([sources[0].inputs], [sources[0].span], [later], TRUTH.D_y, TRUTH.eta, [0.0])
    assert mesh.moved(network.mesh) > 1e-3
    moved = network.fitted(mesh, network.at, gauss_points(40)[0])
    time = np.linspace(0.1, 4.4, 500)
    assert moved.at(0, time).y == pytest.approx(network.at(0, time).y, abs=5e-5)


def test_the_hidden_layer_has_two_nodal_functions_and_the_rest_vanish_at_both_ends():
    layer = HiddenLayer(60, 20, 3)
    ends = layer.values(np.array([0.0, 1.0]))
    expected = np.zeros((2, 20))
    expected[0, 0] = expected[1, 1] = 1.0
    assert ends == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_the_functions_of_the_hidden_layer_come_with_their_derivatives(activation):
    layer = HiddenLayer(60, 12, 3, activation)
    place = np.linspace(0.05, 0.95, 9)
    slopes, curvatures = layer.slopes_and_curvatures(place)
    assert slopes == pytest.approx(layer.slopes(place), rel=1e-12)
    values = (layer.values(place + 1e-5) - layer.values(place - 1e-5)) / 2e-5
    assert values == pytest.approx(slopes, rel=1e-5, abs=1e-5)
    rises = (layer.slopes(place + 1e-5) - layer.slopes(place - 1e-5)) / 2e-5
    assert rises == pytest.approx(curvatures, rel=1e-5, abs=1e-4)


def test_the_field_is_that_of_the_simulation_and_comes_with_its_slopes():
    piece = problem().pieces[0]
    inputs, time = Inputs(piece), np.array([1.4, 1.5004, 1.5101, 1.53, 3.002, 4.0])
    field = inputs.field(time, TRUTH.eta, 0.0)
    assert field.u[2] == pytest.approx(0.3 * (1 - np.exp(-TRUTH.eta * 0.0101)), rel=1e-9)
    more, less = (inputs.field(time, TRUTH.eta + d, 0.0).u for d in (1e-4, -1e-4))
    assert (more - less) / 2e-4 == pytest.approx(field.over_eta, rel=1e-5, abs=1e-10)
    later, earlier = (inputs.field(time, TRUTH.eta, d).u for d in (1e-7, -1e-7))
    assert (later - earlier) / 2e-7 == pytest.approx(field.over_delay, rel=1e-4, abs=1e-6)
    assert np.isfinite(simulate(Setting(TRUTH), piece.stroke).force).all()


def test_blocks_are_set_aside_whole_within_the_piece_and_as_many_as_asked():
    pieces = problem().pieces
    mask = validation_masks(pieces, 0.2, 4)[0]
    assert mask[pieces[0].train == 0].sum() == 0
    assert mask.mean() == pytest.approx(0.2, abs=0.03)
    lengths = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], mask, [0]]))))[::2]
    assert lengths.min() >= 50
    assert mask[:50].sum() == mask[-50:].sum() == 0
    assert not np.array_equal(mask, validation_masks(pieces, 0.2, 5)[0])
    assert validation_masks(pieces, 0.0, 4)[0].sum() == 0
