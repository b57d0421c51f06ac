"""Multilayer perceptron with tanh layers that propagates the derivative along the solution with its values.

Inputs are functions of time. The rate of an output is therefore the product of the network's Jacobian with the
rates of all inputs (a Jacobian-vector product). A partial derivative over an input called t would ignore the rates
of the others, and the law does not apply to it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import torch
from torch import Tensor


class ForwardCache(NamedTuple):
    """Activations of a layer, kept for the backward pass."""

    value: Tensor
    """Activations (N, units)."""
    rate: Tensor
    """Rates of the activations along the solution (N, units) [1/s]."""
    inner_rate: Tensor
    """Rates before the activation function (N, units) [1/s]."""


class Workspace(NamedTuple):
    """Reusable memory of one hidden layer, (units, N) each: allocating memory costs as much as using it."""

    value: Tensor
    """Activations."""
    rate: Tensor
    """Rates of the activations [1/s]."""
    derivative: Tensor
    """Derivative of the activation function."""
    value_gradient: Tensor
    """Gradient of the loss over the input of the activation function."""
    rate_gradient: Tensor
    """Gradient of the loss over the rate of that input [s]."""


class _OutputFunction(torch.autograd.Function):
    """Outputs of a whole network and their rates, with a backward pass for one loss of all of them.

    A row is a unit at all samples, (units, N): products with the weights take a quarter less time in this layout.
    """

    @staticmethod
    def forward(
        ctx: Any,
        network: "Perceptron",
        workspaces: list[Workspace],
        weights: Tensor,
        inputs: Tensor,
        rates: Tensor,
    ) -> tuple[Tensor, Tensor]:
        layers, one, value, rate = network.split_layers(weights), inputs.new_ones(()), inputs, rates
        for (matrix, offset), workspace in zip(layers[:-1], workspaces, strict=True):
            value, rate = (
                torch.addmm(offset[:, None], matrix.T, value, alpha=2.0, beta=2.0, out=workspace.value),
                torch.mm(matrix.T, rate, out=workspace.rate),
            )
            # tanh(a) = 2 sigmoid(2 a) - 1, with a rounding error of that of 1, in a quarter of the time.
            torch.add(-one, value.sigmoid_(), alpha=2.0, out=value)
            rate.mul_(torch.addcmul(one, value, value, value=-1.0, out=workspace.derivative))
        matrix, offset = layers[-1]
        ctx.network, ctx.workspaces = network, workspaces
        ctx.save_for_backward(weights, inputs, rates)
        return torch.addmm(offset[:, None], matrix.T, value), matrix.T @ rate

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[None, None, Tensor, None, None]:
        weights, inputs, rates = ctx.saved_tensors
        network, workspaces = ctx.network, ctx.workspaces
        weight_gradient = torch.empty_like(weights)
        layers, layer_gradients = network.split_layers(weights), network.split_layers(weight_gradient)
        over_value, over_rate = gradients
        for k in range(len(layers) - 1, -1, -1):
            value, rate = (workspaces[k - 1].value, workspaces[k - 1].rate) if k else (inputs, rates)
            torch.mm(value, over_value.T, out=layer_gradients[k][0]).addmm_(rate, over_rate.T)
            torch.sum(over_value, 1, out=layer_gradients[k][1])
            if k:
                workspace, matrix = workspaces[k - 1], layers[k][0]
                over_value = torch.mm(matrix, over_value, out=workspace.value_gradient)
                over_rate = torch.mm(matrix, over_rate, out=workspace.rate_gradient)
                # The rate depends on the value as well: d(derivative * inner rate) = -2 value * rate.
                over_value.mul_(workspace.derivative).addcmul_(value, rate.mul_(over_rate), value=-2.0)
                over_rate.mul_(workspace.derivative)
        network.release_workspace(workspaces)
        return None, None, weight_gradient, None, None


class Perceptron:
    """A multilayer perceptron of given layer sizes; its weights are one flat vector that every method receives."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self._spare: list[Workspace] = []
        self._shapes = list(zip(self.sizes[:-1], self.sizes[1:], strict=True))
        self.weight_count = sum(a * b + b for a, b in self._shapes)

    def initialise_weights(self, seed: int, device: str) -> Tensor:
        """Return random weights (count,), small in the last layer so that training starts near zero."""
        random = torch.Generator().manual_seed(seed)
        parts = []
        for k, (a, b) in enumerate(self._shapes):
            scale = a**-0.5 * (0.3 if k == len(self._shapes) - 1 else 1.0)
            parts.append(scale * torch.randn(a * b, generator=random, dtype=torch.float64))
            parts.append(0.3 * torch.randn(b, generator=random, dtype=torch.float64))
        return torch.cat(parts).to(device)

    def split_layers(self, weights: Tensor) -> list[tuple[Tensor, Tensor]]:
        """Return matrix and offset of each layer as views of the last axis."""
        layers, start = [], 0
        for a, b in self._shapes:
            matrix = weights[..., start : start + a * b].view(*weights.shape[:-1], a, b)
            layers.append((matrix, weights[..., start + a * b : start + a * b + b]))
            start += a * b + b
        return layers

    def forward(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor, list[ForwardCache]]:
        """Return outputs (N, last), their total rates [1/s], and the activations of every layer.

        An additional first axis of all arguments counts networks with their own weights.
        """
        layers = self.split_layers(weights)
        cache = [ForwardCache(inputs, rates, rates)]
        for matrix, offset in layers[:-1]:
            before, inner_rate = cache[-1], cache[-1].rate @ matrix
            value = torch.tanh(before.value @ matrix + offset[..., None, :])
            cache.append(ForwardCache(value, (1.0 - value**2) * inner_rate, inner_rate))
        matrix, offset = layers[-1]
        return cache[-1].value @ matrix + offset[..., None, :], cache[-1].rate @ matrix, cache

    def compute_outputs(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor]:
        """Return outputs (last, N) and their total rates [1/s] for inputs and rates (I, N).

        The gradient of one loss of both over the weights can be computed once.
        """
        workspaces = self._acquire_workspace(inputs)
        outputs = _OutputFunction.apply(self, workspaces, weights, inputs, rates)  # type: ignore[no-untyped-call]
        if not torch.is_grad_enabled():
            self.release_workspace(workspaces)
        return cast(tuple[Tensor, Tensor], outputs)

    def _acquire_workspace(self, inputs: Tensor) -> list[Workspace]:
        """Return a workspace for every hidden layer, that of the last step if its size fits."""
        workspaces, self._spare = self._spare, []
        if workspaces and workspaces[0].value.shape[1] == inputs.shape[1]:
            return workspaces
        return [Workspace(*inputs.new_empty(len(Workspace._fields), n, inputs.shape[1])) for n in self.sizes[1:-1]]

    def release_workspace(self, workspaces: list[Workspace]) -> None:
        """Keep workspaces that are no longer used for the next step."""
        self._spare = workspaces

    def write_jacobian(
        self, weights: Tensor, cache: Sequence[ForwardCache], over_outputs: Tensor, over_rates: Tensor, out: Tensor
    ) -> None:
        """Write the derivatives (N, count) of one residual per sample over all weights to ``out``.

        Args:
            weights: weights (count,); all arguments may have an additional first axis of networks.
            cache: activations of the forward pass.
            over_outputs: derivative of the residual over each output (N, last).
            over_rates: derivative of the residual over each output's rate (N, last).
            out: memory for the derivatives.
        """
        layers = list(zip(self.split_layers(weights), self.split_layers(out), cache, strict=True))
        over_value, over_rate = over_outputs, over_rates
        for (matrix, _), (over_matrix, over_offset), before in reversed(layers):
            torch.mul(before.value[..., None], over_value[..., None, :], out=over_matrix)
            over_matrix.addcmul_(before.rate[..., None], over_rate[..., None, :])
            over_offset.copy_(over_value)
            value, rate = over_value @ matrix.mT, over_rate @ matrix.mT
            derivative = 1.0 - before.value**2
            over_value = value * derivative - 2.0 * rate * before.inner_rate * before.value * derivative
            over_rate = rate * derivative
