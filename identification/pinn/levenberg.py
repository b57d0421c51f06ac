"""Damped Gauss-Newton steps (Levenberg, Marquardt) on dense Jacobians, for about a thousand weights each.

Several least squares of one size go together, each with a damping of its own: a first axis of all arrays counts
them. Normal equations serve here, unlike in the local network: the damping bounds their condition number anyway.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

_TRIES = 6
_HARDER, _EASIER, _LEAST = 5.0, 4.0, 1e-9
_FLAT, _ROUNDING = 1e-7, 1e-11
"""[1] of the largest diagonal element: an unknown with less is held as if it had that; added against rounding."""


class Normal(NamedTuple):
    """Normal equations of B least squares with U unknowns each."""

    products: Tensor
    """(B, U, U) of all columns with each other."""
    gradient: Tensor
    """(B, U)"""
    cost: Tensor
    """(B,) sums of squares."""

    @staticmethod
    def of(slopes: Tensor, rows: Tensor) -> "Normal":
        """From slopes (B, R, U) of the rows (B, R) over the unknowns."""
        gradient = (rows[:, None, :] @ slopes)[:, 0]
        return Normal(gram(slopes), gradient, (rows**2).sum(1))

    @staticmethod
    def joined(parts: Sequence["Normal"]) -> "Normal":
        """Those of several batches, one after the other."""
        return Normal(*(torch.cat(columns) for columns in zip(*parts, strict=True)))

    def only(self, free: Tensor) -> "Normal":
        """With those unknowns left alone where ``free`` (U,) or (B, U) is 0."""
        mask = free.expand_as(self.gradient)
        return Normal(self.products * mask[:, :, None] * mask[:, None, :], self.gradient * mask, self.cost)


class Levenberg:
    """The dampings, which remember how the last steps went.

    Args:
        like: any tensor of their kind and place.
        count: how many least squares.
    """

    def __init__(self, like: Tensor, count: int) -> None:
        self.damping = like.new_ones(count)

    def step(
        self,
        normal: Normal,
        point: Tensor,
        held: Tensor,
        moved: Callable[[Tensor, Tensor], tuple[Tensor, Tensor]],
    ) -> Tensor:
        """Points (B, U) with lower sums of squares; where none was found, the same ones.

        Args:
            normal: equations here.
            point: (B, U) unknowns.
            held: (B, U) further damping of each unknown.
            moved: takes the proposals (b, U) of some, by their numbers (b,), into their bounds; those points, and
                the sums of squares (b,) there.
        """
        diagonal = torch.diagonal(normal.products, dim1=1, dim2=2)
        largest = diagonal.max(1, keepdim=True).values
        scale = torch.maximum(diagonal, _FLAT * largest)
        always = held + _ROUNDING * scale.max(1, keepdim=True).values
        found, left = point.clone(), torch.arange(len(point), device=point.device)
        for _ in range(_TRIES):
            added = self.damping[left, None] * scale[left] + always[left]
            # Where rounding leaves no triangle there are no numbers, and no cost that could be lower.
            triangle, _ = torch.linalg.cholesky_ex(normal.products[left] + torch.diag_embed(added))
            way = torch.cholesky_solve(normal.gradient[left, :, None], triangle)[..., 0]
            there, cost = moved(left, point[left] - way)
            better = cost < normal.cost[left]
            found[left[better]] = there[better]
            eased = torch.clamp(self.damping[left] / _EASIER, min=_LEAST)
            self.damping[left] = torch.where(better, eased, self.damping[left] * _HARDER)
            left = left[~better]
            if not len(left):
                break
        return found


def gram(slopes: Tensor) -> Tensor:
    """(B, U, U) products of all columns of (B, R, U); on the processor by numpy, which makes only half of them."""
    if slopes.is_cuda:
        return slopes.mT @ slopes
    return torch.stack([torch.from_numpy(table.T @ table) for table in slopes.numpy()])
