"""Inputs of the dense network by group, and networks of other depths and inputs."""

import numpy as np
import pytest

from identification.pinn.common.initialisation import InitialStates
from identification.pinn.common.settings import FEATURE_GROUPS, DenseSettings
from identification.pinn.common.training_monitor import TrainingMonitor
from identification.pinn.common.training_pieces import make_training_pieces
from identification.pinn.dense.damper_batch import TrainingDamper
from identification.pinn.dense.inputs import compute_network_inputs
from identification.pinn.dense.training import DenseTraining
from identification.pinn.training import train
from tests.support.pinn_problem import TRUTH, make_problem

PROBLEM = make_problem((0.0, 0.4), 0.5)
SMALL = DenseSettings(width=6, samples=500, steps=10)


def compute_inputs(features):
    pieces = make_training_pieces(PROBLEM)
    slips = [InitialStates(piece, TRUTH).make_slip_velocity() for piece in pieces]
    return compute_network_inputs(pieces, [np.linspace(0.1, 0.9, 40)], slips, TRUTH, features)


def test_the_inputs_are_the_groups_side_by_side():
    joined, groups = compute_inputs(FEATURE_GROUPS), [compute_inputs((group,)) for group in FEATURE_GROUPS]
    assert [group.value.shape[1] for group in groups] == [4, 3, 2, 8]
    assert (np.hstack([group.value for group in groups]) == joined.value).all()
    assert (np.hstack([group.rate for group in groups]) == joined.rate).all()
    assert (compute_inputs(FEATURE_GROUPS[::-1]).value == joined.value).all(), "the order of groups is fixed"


def test_without_memory_samples_are_drawn_evenly():
    weights = {}
    for features in (FEATURE_GROUPS, FEATURE_GROUPS[:-1]):
        weights[features] = TrainingDamper(PROBLEM, 1, features).draw_samples(300)[-1]
    assert np.ptp(weights[FEATURE_GROUPS[:-1]]) == 0.0
    assert np.ptp(weights[FEATURE_GROUPS]) > 0.5


@pytest.mark.parametrize(("layers", "without"), [(1, "time"), (3, "memory")])
def test_a_network_of_another_depth_and_inputs_is_trained(layers, without):
    features = tuple(name for name in FEATURE_GROUPS if name != without)
    settings = SMALL.model_copy(update={"layers": layers, "features": features})
    training = DenseTraining([PROBLEM], settings, TrainingMonitor())
    inputs = sum({"motion": 4, "drive": 3, "time": 2, "memory": 8}[name] for name in features)
    assert training.network.sizes == (inputs, *[6] * layers, 2)
    result = train(PROBLEM, settings)
    assert result.history[-1].force < result.history[0].force
