"""Damped Gauss-Newton steps (Levenberg, Marquardt) on a dense Jacobian, for about a thousand weights.

Normal equations serve here, unlike in the local network: the damping bounds their condition number anyway.
"""

from collections.abc import Callable

import torch
from torch import Tensor

_TRIES = 6
_HARDER, _EASIER, _LEAST = 5.0, 4.0, 1e-9
_FLAT, _ROUNDING = 1e-7, 1e-11
"""[1] of the largest diagonal element: an unknown with less is held as if it had that; added against rounding."""


class Levenberg:
    """The damping, which remembers how the last steps went."""

    def __init__(self) -> None:
        self.damping = 1.0

    def step(
        self,
        slopes: Tensor,
        rows: Tensor,
        point: Tensor,
        held: Tensor,
        moved: Callable[[Tensor], tuple[Tensor, float]],
    ) -> Tensor:
        """A point with a lower sum of squares, or the same one where none was found.

        Args:
            slopes: (R, U) of the rows over the unknowns.
            rows: (R,) residuals here.
            point: (U,) unknowns.
            held: (U,) further damping of each unknown.
            moved: takes a proposal into its bounds; that point and the sum of squares there.
        """
        H, gradient, now = gram(slopes), slopes.T @ rows, float(rows @ rows)
        diagonal = torch.diag(H)
        scale = torch.clamp(diagonal, min=_FLAT * float(diagonal.max()))
        always = held + _ROUNDING * scale.max()
        for _ in range(_TRIES):
            triangle = torch.linalg.cholesky(H + torch.diag(self.damping * scale + always))
            there, cost = moved(point - torch.cholesky_solve(gradient[:, None], triangle)[:, 0])
            if cost < now:
                self.damping = max(self.damping / _EASIER, _LEAST)
                return there
            self.damping *= _HARDER
        return point


def gram(slopes: Tensor) -> Tensor:
    """(U, U) products of all columns with each other; on the processor by numpy, which makes only half of them."""
    if slopes.is_cuda:
        return slopes.T @ slopes
    table = slopes.numpy()
    return torch.from_numpy(table.T @ table)
