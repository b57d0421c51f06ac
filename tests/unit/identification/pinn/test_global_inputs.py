"""What the global network is shown, group by group, and how deep it is."""

import numpy as np
import pytest
from made_up_problem import TRUTH, problem

from identification.pinn.batches import learned
from identification.pinn.beginning import FirstStates
from identification.pinn.global_damper import DamperInTraining
from identification.pinn.global_inputs import network_inputs
from identification.pinn.global_runs import GlobalTraining
from identification.pinn.settings import GROUPS, GlobalSettings
from identification.pinn.supervision import Supervision
from identification.pinn.train import train

GIVEN = problem((0.0, 0.4), 0.5)
SMALL = GlobalSettings(width=6, samples=500, steps=10)


def shown(features):
    pieces = learned(GIVEN)
    slips = [FirstStates(piece, TRUTH).slip_velocity() for piece in pieces]
    return network_inputs(pieces, [np.linspace(0.1, 0.9, 40)], slips, TRUTH, features)


def test_groups_of_inputs_together_are_all_that_is_shown():
    whole, apart = shown(GROUPS), [shown((group,)) for group in GROUPS]
    assert [part.value.shape[1] for part in apart] == [4, 3, 2, 8]
    assert (np.hstack([part.value for part in apart]) == whole.value).all()
    assert (np.hstack([part.rate for part in apart]) == whole.rate).all()
    assert (shown(GROUPS[::-1]).value == whole.value).all(), "in an order of their own"


def test_without_memory_samples_are_drawn_evenly():
    weights = {}
    for features in (GROUPS, GROUPS[:-1]):
        weights[features] = DamperInTraining(GIVEN, 1, features).drawn(300)[-1]
    assert np.ptp(weights[GROUPS[:-1]]) == 0.0
    assert np.ptp(weights[GROUPS]) > 0.5


@pytest.mark.parametrize(("layers", "left"), [(1, "time"), (3, "memory")])
def test_a_network_of_other_depth_and_inputs_is_trained(layers, left):
    features = tuple(name for name in GROUPS if name != left)
    other = SMALL.model_copy(update={"layers": layers, "features": features})
    training = GlobalTraining([GIVEN], other, Supervision())
    inputs = sum({"motion": 4, "drive": 3, "time": 2, "memory": 8}[name] for name in features)
    assert training.network.sizes == (inputs, *[6] * layers, 2)
    found = train(GIVEN, other)
    assert found.history[-1].force < found.history[0].force
