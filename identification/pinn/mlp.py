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


class Room(NamedTuple):
    """Memory for one hidden layer, (units, N) each: new memory costs as much as its use."""

    value: Tensor
    """Activations."""
    rate: Tensor
    """Their rates [1/s]."""
    slope: Tensor
    """Of the activation."""
    over: Tensor
    """Slope of the loss over what goes into the activation."""
    over_rate: Tensor
    """Slope of the loss over its rate [s]."""


class _Outputs(torch.autograd.Function):
    """Outputs of a whole network and their rates; the way back is written out, for one loss of all of them.

    A row is a unit at all samples, (units, N): products with the weights take a quarter less time so.
    """

    @staticmethod
    def forward(
        ctx: Any, network: "Network", room: list[Room], weights: Tensor, inputs: Tensor, rates: Tensor
    ) -> tuple[Tensor, Tensor]:
        layers, one, value, rate = network.layers(weights), inputs.new_ones(()), inputs, rates
        for (matrix, offset), kept in zip(layers[:-1], room, strict=True):
            value, rate = (
                torch.addmm(offset[:, None], matrix.T, value, alpha=2.0, beta=2.0, out=kept.value),
                torch.mm(matrix.T, rate, out=kept.rate),
            )
            # tanh(a) = 2 sigmoid(2 a) - 1, to rounding of 1 and in a quarter of the time.
            torch.add(-one, value.sigmoid_(), alpha=2.0, out=value)
            rate.mul_(torch.addcmul(one, value, value, value=-1.0, out=kept.slope))
        matrix, offset = layers[-1]
        ctx.network, ctx.room = network, room
        ctx.save_for_backward(weights, inputs, rates)
        return torch.addmm(offset[:, None], matrix.T, value), matrix.T @ rate

    @staticmethod
    def backward(ctx: Any, *given: Tensor) -> tuple[None, None, Tensor, None, None]:
        weights, inputs, rates = ctx.saved_tensors
        network, room = ctx.network, ctx.room
        found = torch.empty_like(weights)
        layers, slopes = network.layers(weights), network.layers(found)
        over, over_rate = given
        for k in range(len(layers) - 1, -1, -1):
            value, rate = (room[k - 1].value, room[k - 1].rate) if k else (inputs, rates)
            torch.mm(value, over.T, out=slopes[k][0]).addmm_(rate, over_rate.T)
            torch.sum(over, 1, out=slopes[k][1])
            if k:
                kept, matrix = room[k - 1], layers[k][0]
                over = torch.mm(matrix, over, out=kept.over)
                over_rate = torch.mm(matrix, over_rate, out=kept.over_rate)
                # The slope falls with the value: d(slope * inner rate) = -2 value * rate.
                over.mul_(kept.slope).addcmul_(value, rate.mul_(over_rate), value=-2.0)
                over_rate.mul_(kept.slope)
        network.give_back(room)
        return None, None, found, None, None


class Network:
    """Sizes of the layers; the weights are one flat vector, handed in."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self._spare: list[Room] = []
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
        """Matrix and offset of each layer, as they lie in the last axis."""
        found, place = [], 0
        for a, b in self._shapes:
            matrix = weights[..., place : place + a * b].view(*weights.shape[:-1], a, b)
            found.append((matrix, weights[..., place + a * b : place + a * b + b]))
            place += a * b + b
        return found

    def forward(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor, list[Passed]]:
        """Outputs (N, last), their total rates [1/s], and what every layer handed on.

        A first axis in front of all arguments is of several networks, each with weights of its own.
        """
        layers = self.layers(weights)
        passed = [Passed(inputs, rates, rates)]
        for matrix, offset in layers[:-1]:
            before, inner = passed[-1], passed[-1].rate @ matrix
            value = torch.tanh(before.value @ matrix + offset[..., None, :])
            passed.append(Passed(value, (1.0 - value**2) * inner, inner))
        matrix, offset = layers[-1]
        return passed[-1].value @ matrix + offset[..., None, :], passed[-1].rate @ matrix, passed

    def give_back(self, room: list[Room]) -> None:
        """The room is needed no more."""
        self._spare = room

    def outputs(self, weights: Tensor, inputs: Tensor, rates: Tensor) -> tuple[Tensor, Tensor]:
        """Outputs (last, N) and their total rates [1/s] for inputs and rates (I, N).

        A loss of both has slopes over the weights, once.
        """
        room = self._lent(inputs)
        found = _Outputs.apply(self, room, weights, inputs, rates)  # type: ignore[no-untyped-call]
        if not torch.is_grad_enabled():
            self.give_back(room)
        return cast(tuple[Tensor, Tensor], found)

    def _lent(self, inputs: Tensor) -> list[Room]:
        """Room for every hidden layer, of the step before where it fits."""
        room, self._spare = self._spare, []
        if room and room[0].value.shape[1] == inputs.shape[1]:
            return room
        return [Room(*inputs.new_empty(len(Room._fields), n, inputs.shape[1])) for n in self.sizes[1:-1]]

    def jacobian(
        self, weights: Tensor, passed: Sequence[Passed], over: Tensor, over_rate: Tensor, out: Tensor
    ) -> None:
        """Write the slopes (N, count) of one row per sample over all weights to ``out``.

        Args:
            weights: (count,), or with an axis of networks in front, as all that follows.
            passed: of the forward pass.
            over: (N, last) slope of the row over each output.
            over_rate: (N, last) slope over each output's rate.
            out: where they go.
        """
        layers = list(zip(self.layers(weights), self.layers(out), passed, strict=True))
        for (matrix, _), (slopes, offsets), before in reversed(layers):
            torch.mul(before.value[..., None], over[..., None, :], out=slopes)
            slopes.addcmul_(before.rate[..., None], over_rate[..., None, :])
            offsets.copy_(over)
            value, rate = over @ matrix.mT, over_rate @ matrix.mT
            slope = 1.0 - before.value**2
            over = value * slope - 2.0 * rate * before.inner_rate * before.value * slope
            over_rate = rate * slope
