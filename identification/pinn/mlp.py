"""An ordinary network: tanh layers, with the derivative along the trajectory carried forward beside the value.

Inputs are functions of time, so the rate of an output is the product of the network's Jacobian with the rates of
all its inputs (a Jacobian-vector product). The partial derivative over an input called t would leave the others
standing still, and the law would be asked of something that is no rate of anything.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import torch
from torch import Tensor


class Passed(NamedTuple):
    """What a layer hands on, kept for the way back."""

    value: Tensor
    """(N, units) activations."""
    rate: Tensor
    """(N, units) their rates along the trajectory [1/s]."""
    inner_rate: Tensor
    """(N, units) rates before the activation."""


class _Activation(torch.autograd.Function):
    """The hyperbolic tangent and the rate through it; its way back is written out, in half of autograd's steps."""

    @staticmethod
    def forward(ctx: Any, inner: Tensor, inner_rate: Tensor) -> tuple[Tensor, Tensor]:
        value = torch.tanh(inner)
        slope = torch.addcmul(inner.new_ones(()), value, value, value=-1.0)
        rate = slope * inner_rate
        ctx.save_for_backward(value, slope, rate)
        return value, rate

    @staticmethod
    def backward(ctx: Any, *over: Tensor) -> tuple[Tensor, Tensor]:
        value, slope, rate = ctx.saved_tensors
        # The slope falls with the value: d(slope * inner rate) = -2 value * rate.
        over_inner = (over[0] * slope).addcmul_(value, rate * over[1], value=-2.0)
        return over_inner, over[1] * slope


def _activation(inner: Tensor, inner_rate: Tensor) -> tuple[Tensor, Tensor]:
    """Values (N, units) and their rates [1/s] behind the tanh."""
    return cast(tuple[Tensor, Tensor], _Activation.apply(inner, inner_rate))  # type: ignore[no-untyped-call]


class Network:
    """Sizes of the layers; the weights are one flat vector, handed in."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self._shapes = list(zip(self.sizes[:-1], self.sizes[1:], strict=True))
        self.count = sum(a * b + b for a, b in self._shapes)

    def begin(self, seed: int, device: str) -> Tensor:
        """(count,) random weights; the last layer small, so that training starts near zero."""
        random = torch.Generator().manual_seed(seed)
        parts = []
        for k, (a, b) in enumerate(self._shapes):
            scale = a**-0.5 * (0.3 if k == len(self._shapes) - 1 else 1.0)
            parts.append(scale * torch.randn(a * b, generator=random, dtype=torch.float64))
            parts.append(0.3 * torch.randn(b, generator=random, dtype=torch.float64))
        return torch.cat(parts).to(device)

    def layers(self, weights: Tensor) -> list[tuple[Tensor, Tensor]]:
        """Matrix and offset of each layer."""
        found, place = [], 0
        for a, b in self._shapes:
            matrix = weights[place : place + a * b].reshape(a, b)
            found.append((matrix, weights[place + a * b : place + a * b + b]))
            place += a * b + b
        return found

    def forward(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor, list[Passed]]:
        """Outputs (N, last), their total rates [1/s], and what every layer handed on."""
        layers = self.layers(weights)
        passed = [Passed(inputs, rates, rates)]
        for matrix, offset in layers[:-1]:
            before, inner = passed[-1], passed[-1].rate @ matrix
            value, rate = _activation(torch.addmm(offset, before.value, matrix), inner)
            passed.append(Passed(value, rate, inner))
        matrix, offset = layers[-1]
        return passed[-1].value @ matrix + offset, passed[-1].rate @ matrix, passed

    def jacobian(self, weights: Tensor, passed: Sequence[Passed], over: Tensor, over_rate: Tensor) -> Tensor:
        """(N, count) slopes of one row per sample over all weights.

        Args:
            weights: (count,)
            passed: of the forward pass.
            over: (N, last) slope of the row over each output.
            over_rate: (N, last) slope over each output's rate.
        """
        layers, parts = self.layers(weights), []
        for k in range(len(layers) - 1, -1, -1):
            before = passed[k]
            outer = before.value[:, :, None] * over[:, None] + before.rate[:, :, None] * over_rate[:, None]
            parts.append(torch.cat([outer.reshape(len(over), -1), over], 1))
            if k == 0:
                break
            matrix, _ = layers[k]
            value, rate = over @ matrix.T, over_rate @ matrix.T
            slope = 1.0 - before.value**2
            over = value * slope - 2.0 * rate * before.inner_rate * before.value * slope
            over_rate = rate * slope
        return torch.cat(parts[::-1], 1)
