"""Decisions of the training of the network of elements, with stand-ins of problem and network."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from identification.damper import Coordinates
from identification.fitting import COMMON_COUNT, COORDINATE_COUNT
from identification.pinn.elements.training import ElementTraining

NAMES = Coordinates._fields


def list_free(number, mesh_number, frozen=(), count=COMMON_COUNT + 2):
    free = np.ones(count, bool)
    training = SimpleNamespace(problem=SimpleNamespace(free_mask=free, shared_columns=np.arange(count)))
    stage = SimpleNamespace(frozen_coordinates=frozen)
    chosen = ElementTraining._select_free(training, stage, number, mesh_number)
    coordinates = {name for name, is_free in zip(NAMES, chosen, strict=False) if not is_free}
    return coordinates, set(chosen[COORDINATE_COUNT:COMMON_COUNT]), set(chosen[COMMON_COUNT:])


@pytest.mark.parametrize(
    ("number", "mesh_number", "fixed", "delays", "effects"),
    [
        (0, 0, {"eta", "n"}, False, False),
        (0, 1, {"n"}, False, True),
        (1, 0, {"n"}, True, True),
        (1, 1, {"n"}, True, True),
    ],
)
def test_rate_delays_and_effects_are_freed_one_after_the_other(number, mesh_number, fixed, delays, effects):
    assert list_free(number, mesh_number, ("n",)) == (fixed, {delays}, {effects})


@pytest.mark.parametrize(("change", "settled"), [(0.29, True), (0.31, False)])
def test_a_stage_settles_within_three_tenths_of_a_deviation(change, settled):
    # Information 4: a deviation of 0.5.
    training = SimpleNamespace(unknowns=np.array([1.0, 2.0 + 0.5 * change]), information=np.diag([9.0, 4.0]))
    assert ElementTraining._has_settled(training, np.array([1.0, 2.0])) == settled


def test_the_cost_has_all_squares_and_the_priors():
    training = SimpleNamespace(problem=SimpleNamespace(shared_prior_weights=np.array([0.0, 2.0])))
    residuals = [SimpleNamespace(vector=np.array([[1.0, 2.0]])), SimpleNamespace(vector=np.array([[3.0]]))]
    assert ElementTraining._compute_cost(training, residuals, np.array([9.0, 1.5])) == 14.0 + 9.0
    residuals[0].vector[0, 0] = np.nan
    assert ElementTraining._compute_cost(training, residuals, np.zeros(2)) == np.inf


class Weights(NamedTuple):
    """Output weights on a line."""

    value: float

    def move(self, step, share):
        return Weights(self.value + share * step.value)


@dataclass(frozen=True)
class Network:
    output_weights: Weights


def search(size, highest, cost=100.0):
    """Decrease, unknown and weight after a line search; the cost falls up to a highest unknown."""

    def compute(unknowns, output_weights, weights, multipliers, jacobian):
        return cost - unknowns[0] if unknowns[0] <= highest else cost

    training = SimpleNamespace(
        unknowns=np.zeros(1), network=Network(Weights(0.0)),
        _measure_step=lambda step: size, _compute_cost=lambda residuals, unknowns: residuals,
    )  # fmt: skip
    loss = SimpleNamespace(compute_weighted_residuals=compute)
    decrease = ElementTraining._search_line(training, loss, None, None, np.ones(1), Weights(10.0), cost)
    return decrease, training.unknowns[0], training.network.output_weights.value


@pytest.mark.parametrize(
    ("size", "highest", "share"),
    [
        (0.5, 1.0, 1.0),
        (1.4, 1.0, 0.5),  # limited to 0.7
        (0.5, 0.9, 0.4),
        (0.5, 0.2, 0.16),
        (0.5, 0.4**7 * 1.001, 0.4**7),
        (0.5, 0.4**7 * 0.999, 0.0),
    ],
)
def test_a_step_is_limited_and_shortened_until_the_cost_decreases(size, highest, share):
    assert search(size, highest) == pytest.approx((share, share, 10.0 * share))
