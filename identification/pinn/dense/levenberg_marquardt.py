"""Levenberg-Marquardt steps on dense Jacobians of about a thousand weights each.

Several least-squares problems of one size are solved together, each with its own damping. The first axis of all
arrays counts them. Normal equations are accurate enough here, unlike in the network of elements: the damping
bounds their condition number.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

_MAX_TRIES = 6
_DAMPING_INCREASE, _DAMPING_DECREASE, _MIN_DAMPING = 5.0, 4.0, 1e-9
_MIN_DIAGONAL, _ROUNDING = 1e-7, 1e-11
"""Fractions of the largest diagonal element [1]: least scale of a damping, and term against rounding."""


class NormalEquations(NamedTuple):
    """Normal equations of B least-squares problems with U unknowns each."""

    hessian: Tensor
    """Products of all columns (B, U, U)."""
    gradient: Tensor
    """Products of columns and residuals (B, U)."""
    cost: Tensor
    """Sums of squares (B,)."""

    @staticmethod
    def assemble(jacobian: Tensor, residuals: Tensor) -> "NormalEquations":
        """Return the normal equations of residuals (B, R) with Jacobian (B, R, U)."""
        gradient = (residuals[:, None, :] @ jacobian)[:, 0]
        return NormalEquations(compute_gram(jacobian), gradient, (residuals**2).sum(1))

    @staticmethod
    def concatenate(parts: Sequence["NormalEquations"]) -> "NormalEquations":
        """Return the normal equations of several batches as one batch."""
        return NormalEquations(*(torch.cat(columns) for columns in zip(*parts, strict=True)))

    def restrict(self, free: Tensor) -> "NormalEquations":
        """Return the equations with unknowns fixed where ``free`` (U,) or (B, U) is 0."""
        mask = free.expand_as(self.gradient)
        return NormalEquations(self.hessian * mask[:, :, None] * mask[:, None, :], self.gradient * mask, self.cost)


class LevenbergMarquardt:
    """Solver that adapts the damping of each least-squares problem to the success of its last steps.

    Args:
        like: any tensor of their type and device.
        count: number of least-squares problems.
    """

    def __init__(self, like: Tensor, count: int) -> None:
        self.damping = like.new_ones(count)

    def step(
        self,
        normal: NormalEquations,
        point: Tensor,
        extra_damping: Tensor,
        evaluate: Callable[[Tensor, Tensor], tuple[Tensor, Tensor]],
    ) -> Tensor:
        """Return points (B, U) with lower sums of squares; a problem without a lower one keeps its point.

        Args:
            normal: normal equations at the points.
            point: unknowns (B, U).
            extra_damping: additional damping of each unknown (B, U).
            evaluate: function of problem numbers (b,) and proposed points (b, U) that returns these points within
                their bounds, and the sums of squares (b,) there.
        """
        diagonal = torch.diagonal(normal.hessian, dim1=1, dim2=2)
        largest = diagonal.max(1, keepdim=True).values
        scale = torch.maximum(diagonal, _MIN_DIAGONAL * largest)
        constant = extra_damping + _ROUNDING * scale.max(1, keepdim=True).values
        solution, pending = point.clone(), torch.arange(len(point), device=point.device)
        for _ in range(_MAX_TRIES):
            added = self.damping[pending, None] * scale[pending] + constant[pending]
            # A failed factorisation yields NaN, and its cost is never lower.
            triangle, _ = torch.linalg.cholesky_ex(normal.hessian[pending] + torch.diag_embed(added))
            step = torch.cholesky_solve(normal.gradient[pending, :, None], triangle)[..., 0]
            proposed, cost = evaluate(pending, point[pending] - step)
            better = cost < normal.cost[pending]
            solution[pending[better]] = proposed[better]
            decreased = torch.clamp(self.damping[pending] / _DAMPING_DECREASE, min=_MIN_DAMPING)
            self.damping[pending] = torch.where(better, decreased, self.damping[pending] * _DAMPING_INCREASE)
            pending = pending[~better]
            if not len(pending):
                break
        return solution


def compute_gram(jacobian: Tensor) -> Tensor:
    """Return the products (B, U, U) of all columns (B, R, U); on a processor, numpy computes only half of them."""
    if jacobian.is_cuda:
        return jacobian.mT @ jacobian
    return torch.stack([torch.from_numpy(table.T @ table) for table in jacobian.numpy()])
