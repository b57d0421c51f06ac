"""Rows of the global network's least squares, and their analytic Jacobian over weights and coordinates.

A first axis of all arrays counts dampers, each with weights, coordinates and samples of its own; alone, a damper
is a batch of one.
"""

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
from identification.pinn.levenberg import Normal
from identification.pinn.mesh import Y_UNIT, Indices
from identification.pinn.mlp import Network, Passed
from identification.problem import COORDINATE_COUNT, Problem

HYSTERESIS_SCALE, BALANCE_SCALE = 0.1, 10.0
"""[1] a hysteresis residual of this part of the usual velocity, and a balance residual of ten times the force
noise, weigh as much as one deviation of a sample."""
_PULL = 1e-9
"""[1] of the largest diagonal element, on the weights where the covariance is taken."""
_OUTPUTS = (1.0, Y_UNIT)
"""What one means in z [1] and in y [m]."""
_KINDS = 3
"""Rows of a sample: force misfit, eq. 3 and eq. 4."""


class Samples(NamedTuple):
    """Some samples of each damper, with what does not depend on the weights."""

    piece: Indices
    """(B, N) number of the piece."""
    time: Array
    """(B, N) [s]"""
    value: Tensor
    """(B, N, I) inputs of the network."""
    rate: Tensor
    """(B, N, I) their rates [1/s]."""
    x: Tensor
    """(B, N) [m]"""
    v: Tensor
    """(B, N) [m/s]"""
    force: Tensor
    """(B, N) recorded [N]."""
    fitted: Tensor
    """(B, N) 1 where the force is fitted; the law is asked for everywhere."""
    counts: Tensor
    """(B, N) root of what each stands for [1]."""

    def of(self, dampers: Sequence[int]) -> "Samples":
        """Those of some dampers."""
        piece, time, *rest = self
        some = list(dampers)
        return Samples(piece[some], time[some], *(part[some] for part in rest))


class Recorded(NamedTuple):
    """What is learned of one damper."""

    problem: Problem
    pieces: Sequence[Learned]


@dataclass(frozen=True)
class GlobalLoss:
    """What the global network is trained on."""

    dampers: Sequence[Recorded]
    network: Network

    def of(self, dampers: Sequence[int]) -> "GlobalLoss":
        """That of some of the dampers."""
        return GlobalLoss([self.dampers[k] for k in dampers], self.network)

    def rows(self, s: Samples, weights: Tensor, q: Array, physics: float) -> Tensor:
        """(B, 3 N) force misfit, eq. 3 and eq. 4, weighted.

        Args:
            s: samples.
            weights: (B, W) of the network.
            q: (B, 13) search numbers.
            physics: weight of the law against the force [1].
        """
        out, rate, _ = self.network.forward(weights, s.value, s.rate)
        values, _ = self._values(s, out, rate, q)
        scales = self._weights(s, physics)
        return torch.cat([r * w for r, w in zip(_residuals(s, values), scales, strict=True)], 1)

    def linearised(self, s: Samples, weights: Tensor, q: Array, physics: float) -> tuple[Tensor, Tensor]:
        """The rows (B, 3 N) and their slopes (B, 3 N, W + 13) over weights and search numbers."""
        out, rate, passed = self.network.forward(weights, s.value, s.rate)
        values, over_eta = self._values(s, out, rate, q)
        scales = self._weights(s, physics)
        slopes = self._slopes(values, over_eta, weights, passed, scales, q)
        rows = torch.cat([r * w for r, w in zip(_residuals(s, values), scales, strict=True)], 1)
        return rows, slopes

    def _slopes(
        self, values: dict[str, Any], over_eta: Tensor, weights: Tensor, passed: Sequence[Passed],
        scales: Sequence[Tensor], q: Array,
    ) -> Tensor:  # fmt: skip
        """(B, 3 N, W + 13), written in place: a copy would take as long as the numbers themselves."""
        count, (dampers, samples) = self.network.count, over_eta.shape
        over_search = over_eta.new_tensor(
            np.array([d.problem.space.slopes(own) for d, own in zip(self.dampers, q, strict=True)])
        )
        unit = over_eta.new_tensor(_OUTPUTS)
        table = over_eta.new_empty(dampers, _KINDS * samples, count + COORDINATE_COUNT)
        for k, (over, weight) in enumerate(zip(_law_slopes(values), scales, strict=True)):
            over["eta"] = over.get("u", torch.zeros_like(weight)) * over_eta
            part = table[:, k * samples : (k + 1) * samples]
            outputs, rates = (_columns(over, names, weight) * unit for names in (("z", "y"), ("z_rate", "y_rate")))
            self.network.jacobian(weights, passed, outputs, rates, part[..., :count])
            torch.matmul(_columns(over, Coordinates._fields, weight), over_search, out=part[..., count:])
        return table

    def normal(self, s: Samples, weights: Tensor, q: Array, physics: float) -> Normal:
        """Normal equations of every damper.

        On a processor they are made one damper after the other: products of one fill it, and Jacobians of several
        would only leave its caches.
        """
        every, size = range(len(self.dampers)), len(self.dampers) if weights.is_cuda else 1
        parts = []
        for first in every[::size]:
            some = every[first : first + size]
            rows, slopes = self.of(some).linearised(s.of(some), weights[list(some)], q[list(some)], physics)
            parts.append(Normal.of(slopes, rows))
        return Normal.joined(parts)

    def _values(self, s: Samples, out: Tensor, rate: Tensor, q: Array) -> tuple[dict[str, Any], Tensor]:
        """States, inputs and coordinates by name; the field's slope over eta."""
        points = [d.problem.space.to_coordinates(own) for d, own in zip(self.dampers, q, strict=True)]
        u, over_eta = self._field(s, [c.eta for c in points])
        columns = s.x.new_tensor(np.array(points)).T[..., None]
        values = dict(zip(Coordinates._fields, columns, strict=True)) | {
            "z": out[..., 0], "y": out[..., 1] * Y_UNIT, "z_rate": rate[..., 0], "y_rate": rate[..., 1] * Y_UNIT,
            "x": s.x, "v": s.v, "u": u,
        }  # fmt: skip
        return values, over_eta

    def _weights(self, s: Samples, physics: float) -> tuple[Tensor, Tensor, Tensor]:
        """(B, N) of each kind of row."""
        usual, noise = torch.sqrt(torch.mean(s.v**2, 1, keepdim=True)), s.x.new_tensor(self._noise)[:, None]
        return (
            s.counts * s.fitted / noise,
            physics * s.counts / (HYSTERESIS_SCALE * usual),
            physics * s.counts / (BALANCE_SCALE * noise),
        )

    @property
    def _noise(self) -> Array:
        """(B,) of the force [N]."""
        return np.array([d.problem.noise for d in self.dampers])

    def _field(self, s: Samples, etas: Sequence[float]) -> tuple[Tensor, Tensor]:
        u, over_eta = np.empty(s.time.shape), np.empty(s.time.shape)
        for b, (damper, eta) in enumerate(zip(self.dampers, etas, strict=True)):
            for k, source in enumerate(damper.pieces):
                mine = (b, s.piece[b] == k)
                u[mine], over_eta[mine], _ = source.inputs.field(s.time[mine], eta, source.piece.drive_delay)
        return torch.as_tensor(u, device=s.x.device), torch.as_tensor(over_eta, device=s.x.device)

    def misfits(self, s: Samples, weights: Tensor, q: Array) -> Array:
        """(B, 3) root mean squares without weights: force [N], eq. 3 over the usual velocity [1], eq. 4 [N]."""
        squares = (self.rows(s, weights, q, 1.0) ** 2).reshape(len(q), _KINDS, -1).mean(2).cpu().numpy()
        noise, fitted = self._noise, s.fitted.mean(1).cpu().numpy()
        scales = [noise / np.sqrt(fitted), np.full(len(noise), HYSTERESIS_SCALE), BALANCE_SCALE * noise]
        return np.asarray(np.sqrt(squares) * np.column_stack(scales))

    def covariance(self, s: Samples, weights: Tensor, q: Array, physics: float) -> Array:
        """(B, 13, 13) of the search numbers, the weights marginalised; samples count as many as there are."""
        H = self.normal(s, weights, q, physics).products
        # The weights are many for what they say; a slight pull keeps those that say nothing from being infinite.
        diagonal = torch.diagonal(H, dim1=1, dim2=2)
        diagonal += _PULL * diagonal.max(1, keepdim=True).values
        inverse = torch.linalg.inv(H)[:, -COORDINATE_COUNT:, -COORDINATE_COUNT:].cpu().numpy()
        shares = [s.time.shape[1] / d.problem.samples for d in self.dampers]
        return np.asarray(inverse * np.array(shares)[:, None, None])


def _residuals(s: Samples, values: dict[str, Any]) -> tuple[Tensor, Tensor, Tensor]:
    return law_rows.force(values) - s.force, law_rows.hysteresis(values), law_rows.balance(values)


def _law_slopes(values: dict[str, Any]) -> tuple[dict[str, Tensor], dict[str, Tensor], dict[str, Tensor]]:
    """Of each kind of residual, by name."""
    return (
        law_rows.force_slopes(values),
        law_rows.hysteresis_slopes(values, torch.log),
        law_rows.balance_slopes(values),
    )


def _columns(over: dict[str, Tensor], names: Sequence[str], weight: Tensor) -> Tensor:
    """(B, N, names) weighted slopes; zero where an equation has no such value."""
    return torch.stack([over[name] * weight if name in over else torch.zeros_like(weight) for name in names], -1)
