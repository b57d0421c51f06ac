"""The network of the paper: its rates, its training, and its stop."""

import numpy as np
import pytest
import torch

from identification.damper.coordinates import to_coordinates
from identification.pinn.common.settings import PaperSettings
from identification.pinn.common.training_monitor import TrainingMonitor
from identification.pinn.paper.training import PaperTraining
from identification.pinn.training import train
from tests.support.pinn_problem import make_problem

QUICK_PAPER = PaperSettings(width=8, layers=2, adam_steps=300, lbfgs_steps=0, samples=128, validation_share=0.0)


@pytest.mark.parametrize("steps", [{"adam_steps": 100, "lbfgs_steps": 0}, {"adam_steps": 0, "lbfgs_steps": 100}])
def test_a_stopped_training_of_the_paper_network_returns_its_present_result(steps):
    requests = iter([False, True])
    monitor = TrainingMonitor(should_stop=lambda: next(requests))
    result = train(make_problem((0.0, 0.4), 0.5), QUICK_PAPER.model_copy(update=steps), monitor)
    assert next(requests, None) is None
    assert result.note.startswith("stopped on request")
    assert result.steps < 100


def test_rates_of_the_paper_network_are_those_along_the_trajectory():
    training = PaperTraining(make_problem((0.0, 0.4), 1.0), [np.zeros(2000)], QUICK_PAPER, TrainingMonitor())
    samples = torch.tensor([200, 555, 1500])
    inputs = training.pieces[0].inputs

    def evaluate_states(time):
        x, v = inputs.evaluate_motion(time)
        d = training.data
        scale = np.array([np.abs(d.x.numpy()).max(), d.v.numpy().std(), 0.4, 0.9995])
        drive = inputs.evaluate_drive(time, 0.0)
        values = np.column_stack([x, v, drive, time - 0.9995]) / scale
        zero = torch.zeros(values.shape, dtype=torch.float64)
        return training.network.forward(training.weights, torch.as_tensor(values), zero)[0].detach().numpy()

    time = samples.numpy() * inputs.h
    expected = (evaluate_states(time + 1e-6) - evaluate_states(time - 1e-6)) / 2e-6
    units = np.array([training.scales.u, training.scales.y, training.scales.z])
    _, rates = training._compute_states(training.data.select(samples))
    assert pytest.approx(expected * units, rel=1e-3, abs=1e-9) == rates.detach().numpy().T


def test_the_paper_network_learns_the_force_and_returns_parameters_of_a_damper():
    problem = make_problem((0.0, 0.4), 1.0)
    result = train(problem, QUICK_PAPER)
    errors = [record.force for record in result.history]
    assert errors[-1] < 0.8 * float(np.std(problem.pieces[0].force))
    assert errors[-1] < errors[0]
    assert not result.accepted
    assert result.covariance is None
    assert to_coordinates(result.parameters).D_y > 0
