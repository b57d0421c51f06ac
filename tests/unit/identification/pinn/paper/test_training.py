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


@pytest.fixture
def training():
    return PaperTraining(make_problem((0.0, 0.4), 1.0), [np.zeros(2000)], QUICK_PAPER, TrainingMonitor())


def test_scales_are_the_sizes_of_the_data_and_of_the_first_guess(training):
    scales, data, start = training.scales, training.data, training.start_parameters
    assert (scales.u, scales.y, scales.rate) == pytest.approx((0.4, 0.01, start.eta), rel=1e-4)
    assert scales.velocity == pytest.approx(0.01 * 2 * np.pi * 1.5 / np.sqrt(2.0), rel=1e-3)
    assert scales.force == pytest.approx(data.force.numpy().std(ddof=1))
    assert scales.z == pytest.approx(start.A * to_coordinates(start).D_y)


def test_samples_are_selected_in_even_steps(training):
    training.data.x[:] = torch.arange(2000)
    assert training._select_evenly(3).x.tolist() == [0.0, 999.0, 1999.0]
    assert training._select_evenly(5000).x.tolist() == list(range(2000))


def test_forces_and_residuals_are_those_of_the_law(training, monkeypatch):
    d = training.data.select(torch.tensor([300, 1400]))
    u, y, z, u_rate, y_rate, z_rate = (np.array(pair) for pair in (
        (0.1, 0.3), (0.004, -0.002), (2e-4, -3e-4), (0.5, -0.2), (0.02, 0.03), (0.01, -0.02),
    ))  # fmt: skip
    states = torch.as_tensor(np.stack([u, y, z])), torch.as_tensor(np.stack([u_rate, y_rate, z_rate]))
    monkeypatch.setattr(training, "_compute_states", lambda samples: states)
    p, s = training.start_parameters, training.scales
    x, v, drive = (q.numpy() for q in (d.x, d.v, d.drive))
    alpha, c0, c1 = p.alpha_a + p.alpha_b * u, p.c0_a + p.c0_b * u, p.c1_a + p.c1_b * u
    inner = alpha * z + p.k0 * (x - y)
    first = inner + c0 * (v - y_rate) + p.k1 * (x - p.x0)
    second = c1 * y_rate + p.k1 * (x - p.x0)
    slip = v - y_rate
    hysteresis = p.A * slip - (
        p.gamma * np.abs(slip) * z * np.abs(z) ** (p.n - 1) + p.beta * slip * np.abs(z) ** p.n
    )
    residuals = [
        (u_rate + p.eta * (u - drive)) / (p.eta * 0.4),
        (y_rate - (inner + c0 * v) / (c0 + c1)) / s.velocity,
        (z_rate - hysteresis) / (p.A * s.velocity),
    ]
    forces, scaled = training._compute_equations(d)
    assert forces.detach().numpy() == pytest.approx(np.stack([first, second]))
    numbers = scaled.detach().numpy()
    assert numbers == pytest.approx(np.stack(residuals))
    misfits = (np.stack([first, second]) - d.force.numpy()) / s.force
    loss = QUICK_PAPER.phi_data * np.sum(misfits**2) / 2.0 + QUICK_PAPER.phi_phys * np.sum(numbers**2) / 2.0
    assert training._compute_loss(d).item() == pytest.approx(loss)
