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


_BLOCK = 512
"""Samples that are taken through all layers before the next: their activations stay in the processor's cache."""


class _Outputs(torch.autograd.Function):
    """Outputs of a whole network and their rates; the way back is written out, for one loss of all of them."""

    @staticmethod
    def forward(
        ctx: Any, network: "Network", weights: Tensor, inputs: Tensor, rates: Tensor
    ) -> tuple[Tensor, Tensor]:
        layers, room = network.layers(weights), network.lend(inputs)
        one = inputs.new_ones(())
        out, out_rate = (inputs.new_empty(len(inputs), network.sizes[-1]) for _ in range(2))
        for block in _blocks(inputs):
            value, rate = inputs[block], rates[block]
            for (matrix, offset), kept in zip(layers[:-1], room, strict=True):
                inner, inner_rate, slope = kept[0, block], kept[1, block], kept[2, block]
                _to_tanh(torch.addmm(offset, value, matrix, out=inner))
                torch.mm(rate, matrix, out=inner_rate)
                torch.addcmul(one, inner, inner, value=-1.0, out=slope)
                value, rate = inner, inner_rate.mul_(slope)
            matrix, offset = layers[-1]
            torch.addmm(offset, value, matrix, out=out[block])
            torch.mm(rate, matrix, out=out_rate[block])
        ctx.network, ctx.room = network, room
        ctx.save_for_backward(weights, inputs, rates)
        return out, out_rate

    @staticmethod
    def backward(ctx: Any, *given: Tensor) -> tuple[None, Tensor, None, None]:
        weights, inputs, rates = ctx.saved_tensors
        network, room = ctx.network, ctx.room
        found = torch.zeros_like(weights)
        layers, slopes = network.layers(weights), network.layers(found)
        passed = [(inputs, rates), *((kept[0], kept[1]) for kept in room)]
        for block in _blocks(inputs):
            over, over_rate = given[0][block], given[1][block]
            for k in range(len(layers) - 1, -1, -1):
                value, rate = (part[block] for part in passed[k])
                slopes[k][0].addmm_(value.T, over).addmm_(rate.T, over_rate)
                slopes[k][1].add_(over.sum(0))
                if k:
                    slope, matrix = room[k - 1][2, block], layers[k][0].T
                    over, over_rate = over @ matrix, over_rate @ matrix
                    # The slope falls with the value: d(slope * inner rate) = -2 value * rate.
                    over.mul_(slope).addcmul_(value, rate.mul_(over_rate), value=-2.0)
                    over_rate.mul_(slope)
        network.give_back(room)
        return None, found, None, None


def _to_tanh(inner: Tensor) -> None:
    """The hyperbolic tangent in place, by one exponential: to rounding of 1, in half of torch's own time."""
    inner.mul_(2.0).exp_().add_(1.0).reciprocal_().mul_(-2.0).add_(1.0)


def _blocks(inputs: Tensor) -> list[slice]:
    """Where each block of the samples stands; an accelerator takes all at once."""
    size = _BLOCK if inputs.device.type == "cpu" else len(inputs)
    return [slice(at, at + size) for at in range(0, len(inputs), size)]


class Network:
    """Sizes of the layers; the weights are one flat vector, handed in."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self._spare: list[Tensor] = []
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
            value = torch.tanh(torch.addmm(offset, before.value, matrix))
            passed.append(Passed(value, (1.0 - value**2) * inner, inner))
        matrix, offset = layers[-1]
        return passed[-1].value @ matrix + offset, passed[-1].rate @ matrix, passed

    def lend(self, inputs: Tensor) -> list[Tensor]:
        """Room (3, N, units) a layer for values, rates and slopes: new memory costs as much as its use."""
        room, self._spare = self._spare, []
        if room and room[0].shape[1] == len(inputs):
            return room
        return [inputs.new_empty(3, len(inputs), units) for units in self.sizes[1:-1]]

    def give_back(self, room: list[Tensor]) -> None:
        """The room is needed no more."""
        self._spare = room

    def outputs(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor]:
        """Outputs (N, last) and their total rates [1/s]; a loss of them has slopes over the weights, once."""
        return cast(tuple[Tensor, Tensor], _Outputs.apply(self, weights, inputs, rates))  # type: ignore[no-untyped-call]

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
