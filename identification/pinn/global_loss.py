"""Rows of the global network's least squares, and their analytic Jacobian over weights and coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn import law_rows
from identification.pinn.batches import Learned
from identification.pinn.levenberg import gram
from identification.pinn.mesh import Y_UNIT, Indices
from identification.pinn.mlp import Network
from identification.problem import COORDINATE_COUNT, Problem

HYSTERESIS_SCALE, BALANCE_SCALE = 0.1, 10.0
"""[1] a hysteresis residual of this part of the usual velocity, and a balance residual of ten times the force
noise, weigh as much as one deviation of a sample."""
_PULL = 1e-9
"""[1] of the largest diagonal element, on the weights where the covariance is taken."""
_OUTPUTS = (1.0, Y_UNIT)
"""What one means in z [1] and in y [m]."""


class Samples(NamedTuple):
    """Some samples, with what does not depend on the weights."""

    value: Tensor
    """(N, I) inputs of the network."""
    rate: Tensor
    """(N, I) their rates [1/s]."""
    x: Tensor
    """(N,) [m]"""
    v: Tensor
    """(N,) [m/s]"""
    force: Tensor
    """(N,) recorded [N]."""
    fitted: Tensor
    """(N,) 1 where the force is fitted; the law is asked for everywhere."""
    counts: Tensor
    """(N,) root of what each stands for [1]."""
    piece: Indices
    """(N,) number of the piece."""
    time: Array
    """(N,) [s]"""


@dataclass(frozen=True)
class GlobalLoss:
    """What the global network is trained on."""

    problem: Problem
    pieces: Sequence[Learned]
    network: Network

    def rows(self, s: Samples, weights: Tensor, q: Array, physics: float) -> Tensor:
        """(3 N,) force misfit, eq. 3 and eq. 4, weighted."""
        out, rate, _ = self.network.forward(weights, s.value, s.rate)
        values, _ = self._values(s, out, rate, q)
        scales = self._weights(s, physics)
        return torch.cat([r * w for r, w in zip(_residuals(s, values), scales, strict=True)])

    def linearised(self, s: Samples, weights: Tensor, q: Array, physics: float) -> tuple[Tensor, Tensor]:
        """The rows (3 N,) and their slopes (3 N, W + 13) over weights and search numbers."""
        out, rate, passed = self.network.forward(weights, s.value, s.rate)
        values, over_eta = self._values(s, out, rate, q)
        over_search = torch.as_tensor(self.problem.space.slopes(q), device=s.x.device)
        unit = torch.tensor(_OUTPUTS, dtype=s.x.dtype, device=s.x.device)
        scales, tables = self._weights(s, physics), []
        for over, weight in zip(_slopes(values), scales, strict=True):
            over["eta"] = over.get("u", torch.zeros_like(weight)) * over_eta
            outputs, rates = (_columns(over, names, weight) * unit for names in (("z", "y"), ("z_rate", "y_rate")))
            shared = _columns(over, Coordinates._fields, weight) @ over_search
            tables.append(torch.cat([self.network.jacobian(weights, passed, outputs, rates), shared], 1))
        rows = torch.cat([r * w for r, w in zip(_residuals(s, values), scales, strict=True)])
        return rows, torch.cat(tables)

    def _values(self, s: Samples, out: Tensor, rate: Tensor, q: Array) -> tuple[dict[str, Any], Tensor]:
        """States, inputs and coordinates by name; the field's slope over eta."""
        c = self.problem.space.to_coordinates(q)
        u, over_eta = self._field(s, c.eta)
        values = c._asdict() | {
            "z": out[:, 0], "y": out[:, 1] * Y_UNIT, "z_rate": rate[:, 0], "y_rate": rate[:, 1] * Y_UNIT,
            "x": s.x, "v": s.v, "u": u,
        }  # fmt: skip
        return values, over_eta

    def _weights(self, s: Samples, physics: float) -> tuple[Tensor, Tensor, Tensor]:
        """(N,) of each kind of row."""
        usual, noise = torch.sqrt(torch.mean(s.v**2)), self.problem.noise
        return (
            s.counts * s.fitted / noise,
            physics * s.counts / (HYSTERESIS_SCALE * usual),
            physics * s.counts / (BALANCE_SCALE * noise),
        )

    def _field(self, s: Samples, eta: float) -> tuple[Tensor, Tensor]:
        u, over_eta = np.empty(len(s.time)), np.empty(len(s.time))
        for k, source in enumerate(self.pieces):
            mine = s.piece == k
            u[mine], over_eta[mine], _ = source.inputs.field(s.time[mine], eta, source.piece.drive_delay)
        return torch.as_tensor(u, device=s.x.device), torch.as_tensor(over_eta, device=s.x.device)

    def misfits(self, s: Samples, weights: Tensor, q: Array) -> tuple[float, float, float]:
        """Root mean squares without weights: force [N], eq. 3 over the usual velocity [1], eq. 4 [N]."""
        squares = self.rows(s, weights, q, 1.0).reshape(3, -1) ** 2
        force, hysteresis, balance = torch.sqrt(squares.mean(1)).tolist()
        noise = self.problem.noise
        return (
            noise * force / float(s.fitted.mean()) ** 0.5,
            HYSTERESIS_SCALE * hysteresis,
            BALANCE_SCALE * noise * balance,
        )

    def covariance(self, s: Samples, weights: Tensor, q: Array, physics: float) -> Array:
        """(13, 13) of the search numbers, the weights marginalised; samples count as many as there are."""
        _, J = self.linearised(s, weights, q, physics)
        # The weights are many for what they say; a slight pull keeps those that say nothing from being infinite.
        H = gram(J)
        H.diagonal().add_(_PULL * float(torch.diag(H).max()))
        inverse = torch.linalg.inv(H)[-COORDINATE_COUNT:, -COORDINATE_COUNT:].cpu().numpy()
        return np.asarray(inverse * len(s.x) / self.problem.samples)


def _residuals(s: Samples, values: dict[str, Any]) -> tuple[Tensor, Tensor, Tensor]:
    return law_rows.force(values) - s.force, law_rows.hysteresis(values), law_rows.balance(values)


def _slopes(values: dict[str, Any]) -> tuple[dict[str, Tensor], dict[str, Tensor], dict[str, Tensor]]:
    """Of each kind of residual, by name."""
    return (
        law_rows.force_slopes(values),
        law_rows.hysteresis_slopes(values, torch.log),
        law_rows.balance_slopes(values),
    )


def _columns(over: dict[str, Tensor], names: Sequence[str], weight: Tensor) -> Tensor:
    """(N, names) weighted slopes; zero where an equation has no such value."""
    return torch.stack([over[name] * weight if name in over else torch.zeros_like(weight) for name in names], 1)
