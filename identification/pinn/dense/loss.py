"""Weighted residuals of the dense network, and their analytic Jacobian over weights and coordinates.

The first axis of all arrays counts dampers, each with its own weights, coordinates and samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import COORDINATE_COUNT, Problem
from identification.pinn.common import Y_UNIT, Indices, TrainingPiece, law_residuals
from identification.pinn.dense.levenberg_marquardt import NormalEquations
from identification.pinn.dense.mlp import ForwardCache, Perceptron

HYSTERESIS_SCALE, BALANCE_SCALE = 0.1, 10.0
"""Scales of law residuals [1]: hysteresis over the rms velocity, balance over the force noise.

A law residual of its scale counts as much as a force misfit of one standard deviation at a sample.
"""
_RIDGE = 1e-9
"""Ridge on the weights for the covariance, over the largest diagonal element [1]."""
_OUTPUT_UNITS = (1.0, Y_UNIT)
"""Units of the outputs z [1] and y [m]."""
_RESIDUAL_KINDS = 3
"""Number of residuals of a sample: force misfit, eq. 3 and eq. 4."""


class Samples(NamedTuple):
    """Some samples of each damper, with all quantities that do not depend on the weights."""

    piece: Indices
    """Index of the piece (B, N)."""
    time: Array
    """Time (B, N) [s]."""
    value: Tensor
    """Inputs of the network (B, N, I)."""
    rate: Tensor
    """Rates of the inputs (B, N, I) [1/s]."""
    x: Tensor
    """Displacement (B, N) [m]."""
    v: Tensor
    """Velocity (B, N) [m/s]."""
    force: Tensor
    """Recorded force (B, N) [N]."""
    fitted: Tensor
    """Mask (B, N) that is 1 where the force is fitted; law residuals count at all samples."""
    sample_weights: Tensor
    """Root of the number of samples that each sample represents (B, N) [1]."""

    def select(self, dampers: Sequence[int]) -> "Samples":
        """Return the samples of some dampers."""
        piece, time, *columns = self
        rows = list(dampers)
        return Samples(piece[rows], time[rows], *(column[rows] for column in columns))


class DamperRecording(NamedTuple):
    """Problem and training pieces of one damper."""

    problem: Problem
    pieces: Sequence[TrainingPiece]


@dataclass(frozen=True)
class DenseLoss:
    """Loss of the dense network over its weights and the coordinates of each damper."""

    dampers: Sequence[DamperRecording]
    network: Perceptron

    def select(self, dampers: Sequence[int]) -> "DenseLoss":
        """Return the loss of some of the dampers."""
        return DenseLoss([self.dampers[k] for k in dampers], self.network)

    def compute_weighted_residuals(self, s: Samples, weights: Tensor, q: Array, law_weight: float) -> Tensor:
        """Return weighted residuals (B, 3 N): force misfits, eq. 3, eq. 4.

        Args:
            s: samples.
            weights: weights of the network (B, W).
            q: search coordinates (B, 13).
            law_weight: weight of the law residuals against the force misfit [1].
        """
        outputs, rates, _ = self.network.forward(weights, s.value, s.rate)
        values, _ = self._compute_values(s, outputs, rates, q)
        return _weigh_residuals(s, values, self._compute_scales(s, law_weight))

    def linearise(self, s: Samples, weights: Tensor, q: Array, law_weight: float) -> tuple[Tensor, Tensor]:
        """Return weighted residuals (B, 3 N), and their Jacobian (B, 3 N, W + 13) over weights and coordinates."""
        outputs, rates, cache = self.network.forward(weights, s.value, s.rate)
        values, du_deta = self._compute_values(s, outputs, rates, q)
        scales = self._compute_scales(s, law_weight)
        jacobian = self._compute_jacobian(values, du_deta, weights, cache, scales, q)
        return _weigh_residuals(s, values, scales), jacobian

    def _compute_jacobian(
        self, values: dict[str, Any], du_deta: Tensor, weights: Tensor, cache: Sequence[ForwardCache],
        scales: Sequence[Tensor], q: Array,
    ) -> Tensor:  # fmt: skip
        """Return the Jacobian (B, 3 N, W + 13), written in place: a copy would take as long as its computation."""
        count, (dampers, samples) = self.network.weight_count, du_deta.shape
        derivatives = [d.problem.space.differentiate(row) for d, row in zip(self.dampers, q, strict=True)]
        search_jacobian, units = du_deta.new_tensor(np.array(derivatives)), du_deta.new_tensor(_OUTPUT_UNITS)
        jacobian = du_deta.new_empty(dampers, _RESIDUAL_KINDS * samples, count + COORDINATE_COUNT)
        for k, (partials, scale) in enumerate(zip(_differentiate_residuals(values), scales, strict=True)):
            partials["eta"] = partials.get("u", torch.zeros_like(scale)) * du_deta
            rows = jacobian[:, k * samples : (k + 1) * samples]
            over_outputs, over_rates = (
                _stack_columns(partials, names, scale) * units for names in (("z", "y"), ("z_rate", "y_rate"))
            )
            self.network.write_jacobian(weights, cache, over_outputs, over_rates, rows[..., :count])
            over_coordinates = _stack_columns(partials, Coordinates._fields, scale)
            torch.matmul(over_coordinates, search_jacobian, out=rows[..., count:])
        return jacobian

    def assemble_normal_equations(
        self, s: Samples, weights: Tensor, q: Array, law_weight: float
    ) -> NormalEquations:
        """Return the normal equations of every damper.

        On a processor they are assembled damper by damper: the products of one damper keep it busy, and the
        Jacobians of several would not fit its caches.
        """
        numbers, size = range(len(self.dampers)), len(self.dampers) if weights.is_cuda else 1
        parts = []
        for first in numbers[::size]:
            group = numbers[first : first + size]
            residuals, jacobian = self.select(group).linearise(
                s.select(group), weights[list(group)], q[list(group)], law_weight
            )
            parts.append(NormalEquations.assemble(jacobian, residuals))
        return NormalEquations.concatenate(parts)

    def _compute_values(
        self, s: Samples, outputs: Tensor, rates: Tensor, q: Array
    ) -> tuple[dict[str, Any], Tensor]:
        """Return states, inputs and coordinates by name, and the field's derivative over eta."""
        points = [d.problem.space.to_coordinates(row) for d, row in zip(self.dampers, q, strict=True)]
        u, du_deta = self._evaluate_field(s, [c.eta for c in points])
        columns = s.x.new_tensor(np.array(points)).T[..., None]
        values = dict(zip(Coordinates._fields, columns, strict=True)) | {
            "z": outputs[..., 0], "y": outputs[..., 1] * Y_UNIT,
            "z_rate": rates[..., 0], "y_rate": rates[..., 1] * Y_UNIT,
            "x": s.x, "v": s.v, "u": u,
        }  # fmt: skip
        return values, du_deta

    def _compute_scales(self, s: Samples, law_weight: float) -> tuple[Tensor, Tensor, Tensor]:
        """Return the weights (B, N) of each kind of residual."""
        rms_velocity = torch.sqrt(torch.mean(s.v**2, 1, keepdim=True))
        noise = s.x.new_tensor(self._noise)[:, None]
        return (
            s.sample_weights * s.fitted / noise,
            law_weight * s.sample_weights / (HYSTERESIS_SCALE * rms_velocity),
            law_weight * s.sample_weights / (BALANCE_SCALE * noise),
        )

    @property
    def _noise(self) -> Array:
        """Force noise of each damper (B,) [N]."""
        return np.array([d.problem.noise for d in self.dampers])

    def _evaluate_field(self, s: Samples, etas: Sequence[float]) -> tuple[Tensor, Tensor]:
        u, du_deta = np.empty(s.time.shape), np.empty(s.time.shape)
        for b, (damper, eta) in enumerate(zip(self.dampers, etas, strict=True)):
            for k, source in enumerate(damper.pieces):
                mask = (b, s.piece[b] == k)
                u[mask], du_deta[mask], _ = source.inputs.evaluate_field(
                    s.time[mask], eta, source.piece.drive_delay
                )
        return torch.as_tensor(u, device=s.x.device), torch.as_tensor(du_deta, device=s.x.device)

    def compute_misfits(self, s: Samples, weights: Tensor, q: Array) -> Array:
        """Return unweighted rms residuals (B, 3): force [N], eq. 3 over the rms velocity [1], eq. 4 [N]."""
        squares = (
            (self.compute_weighted_residuals(s, weights, q, 1.0) ** 2)
            .reshape(len(q), _RESIDUAL_KINDS, -1)
            .mean(2)
            .cpu()
            .numpy()
        )
        noise, fitted = self._noise, s.fitted.mean(1).cpu().numpy()
        scales = [noise / np.sqrt(fitted), np.full(len(noise), HYSTERESIS_SCALE), BALANCE_SCALE * noise]
        return np.asarray(np.sqrt(squares) * np.column_stack(scales))

    def compute_covariance(self, s: Samples, weights: Tensor, q: Array, law_weight: float) -> Array:
        """Return the covariance (B, 13, 13) of the search coordinates for all samples, weights marginalised."""
        H = self.assemble_normal_equations(s, weights, q, law_weight).hessian
        # The data do not determine all weights; a small ridge keeps the covariance of the others finite.
        diagonal = torch.diagonal(H, dim1=1, dim2=2)
        diagonal += _RIDGE * diagonal.max(1, keepdim=True).values
        inverse = torch.linalg.inv(H)[:, -COORDINATE_COUNT:, -COORDINATE_COUNT:].cpu().numpy()
        shares = [s.time.shape[1] / d.problem.samples for d in self.dampers]
        return np.asarray(inverse * np.array(shares)[:, None, None])


def _weigh_residuals(s: Samples, values: dict[str, Any], scales: Sequence[Tensor]) -> Tensor:
    """Return the weighted residuals (B, 3 N) of all kinds."""
    residuals = (
        law_residuals.compute_force(values) - s.force,
        law_residuals.compute_hysteresis_residual(values),
        law_residuals.compute_balance_residual(values),
    )
    return torch.cat([r * scale for r, scale in zip(residuals, scales, strict=True)], 1)


def _differentiate_residuals(
    values: dict[str, Any],
) -> tuple[dict[str, Tensor], dict[str, Tensor], dict[str, Tensor]]:
    """Return the partials of each kind of residual by name."""
    return (
        law_residuals.differentiate_force(values),
        law_residuals.differentiate_hysteresis(values, torch.log),
        law_residuals.differentiate_balance(values),
    )


def _stack_columns(partials: dict[str, Tensor], names: Sequence[str], scale: Tensor) -> Tensor:
    """Return scaled partials (B, N, names); zero for quantities that an equation does not contain."""
    columns = [partials[name] * scale if name in partials else torch.zeros_like(scale) for name in names]
    return torch.stack(columns, -1)
