"""Analytic Jacobian of the dense network against finite differences."""

import numpy as np
import pytest
import torch
from numpy.random import default_rng

from identification.pinn.common.training_pieces import make_training_pieces
from identification.pinn.dense.loss import DamperRecording, DenseLoss, Samples
from identification.pinn.dense.mlp import Perceptron
from tests.support.pinn_problem import make_problem, make_unknowns

STEP = 1e-6


def make_samples(problem, inputs=5, dampers=1):
    random = default_rng(2)
    source = make_training_pieces(problem)[0]
    time = np.sort(random.uniform(0.05, source.inputs.duration - 0.05, (dampers, 40)))
    x, v = source.inputs.evaluate_motion(time)
    network_inputs = random.standard_normal((2, dampers, 40, inputs))
    columns = (*network_inputs, x, v, 100 * v, np.ones_like(x), np.ones_like(x))
    return Samples(np.zeros(time.shape, np.int64), time, *map(torch.as_tensor, columns))


def test_the_jacobian_of_each_damper_of_a_batch_is_that_of_finite_differences():
    problems = (make_problem((0.0, 0.4), 0.8), make_problem((0.0, 0.3), 0.8, seed=4))
    samples, network = make_samples(problems[0], dampers=2), Perceptron([5, 6, 6, 2])
    loss = DenseLoss([DamperRecording(problem, make_training_pieces(problem)) for problem in problems], network)
    weights = torch.stack([network.initialise_weights(seed, "cpu") for seed in (1, 2)])
    q = np.array([make_unknowns(problem, seed)[:13] for seed, problem in enumerate(problems)])
    random = default_rng(3)
    weight_step = torch.as_tensor(random.standard_normal((2, network.weight_count)))
    step = random.standard_normal((2, 13))
    residuals, J = loss.linearise(samples, weights, q, 4.0)
    assert torch.equal(residuals, loss.compute_weighted_residuals(samples, weights, q, 4.0))
    high, low = (
        loss.compute_weighted_residuals(samples, weights + s * weight_step, q + s * step, 4.0)
        for s in (STEP, -STEP)
    )
    expected = ((high - low) / (2 * STEP)).numpy()
    change = (J @ torch.cat([weight_step, torch.as_tensor(step)], 1)[..., None])[..., 0].numpy()
    assert change == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())
