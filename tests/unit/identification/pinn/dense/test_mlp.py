"""Rates and gradients of the multilayer perceptron."""

import torch

from identification.pinn.dense.mlp import Perceptron


def test_the_derivative_carried_forward_is_that_of_automatic_differentiation():
    network = Perceptron([3, 5, 4, 2])
    weights = network.initialise_weights(7, "cpu")
    inputs, rates = torch.randn(6, 3, dtype=torch.float64), torch.randn(6, 3, dtype=torch.float64)

    def evaluate(values):
        return network.forward(weights, values, torch.zeros_like(values))[0]

    _, expected = torch.autograd.functional.jvp(evaluate, inputs, rates)
    assert torch.allclose(network.forward(weights, inputs, rates)[1], expected)


def test_the_backward_pass_through_outputs_and_rates_is_that_of_automatic_differentiation():
    network = Perceptron([3, 5, 4, 2])
    weights = network.initialise_weights(7, "cpu").requires_grad_()
    inputs, rates = torch.randn(1100, 3, dtype=torch.float64), torch.randn(1100, 3, dtype=torch.float64)

    def evaluate_automatically():
        value, rate, _ = network.forward(weights, inputs, rates)
        return value.T, rate.T

    def differentiate(value, rate):
        return torch.autograd.grad((value * rate).sum() + (value[0] ** 3).sum() + (rate**2).sum(), weights)[0]

    def is_same(tensor, expected):
        return torch.allclose(tensor, expected, rtol=1e-11, atol=1e-11 * float(expected.detach().abs().max()))

    for outputs in [network.compute_outputs(weights, inputs.T, rates.T) for _ in range(2)]:
        assert all(is_same(*pair) for pair in zip(outputs, evaluate_automatically(), strict=True))
        assert is_same(differentiate(*outputs), differentiate(*evaluate_automatically()))
    with torch.no_grad():
        assert all(map(is_same, network.compute_outputs(weights, inputs.T, rates.T), evaluate_automatically()))
