"""Result of a training: network, shared unknowns and unweighted misfits."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.fitting import Problem
from identification.pinn.elements.mesh import ElementNetwork, OutputWeights
from identification.pinn.elements.residuals import ElementLoss


class Misfit(NamedTuple):
    """Root mean square residuals of a network, without weights."""

    force: float
    """Force misfit over the fitted samples [N]."""
    hysteresis: float
    """Residual of eq. 3 over the slip velocity at breakthrough [1]."""
    balance: float
    """Residual of eq. 4 [N]."""
    unresolved: float
    """Lower bound of the hysteresis residual, over the slip velocity at breakthrough [1].

    It is the part of the stroke's velocity that the basis functions cannot follow.
    """


@dataclass(frozen=True)
class TrainedNetwork:
    """A trained network with its shared unknowns."""

    unknowns: Array
    """Shared unknowns (C,): search coordinates, residual delays, effect parameters, per-log parameters."""
    network: ElementNetwork
    information: Array
    """Information matrix (C, C) of the last factorisation, for the noise with which force misfits are scaled."""
    misfit: Misfit
    steps: int

    def compute_covariance(self, problem: Problem) -> Array:
        """Return the covariance (C, C) of the shared unknowns; rows of fixed unknowns are zero."""
        free = problem.free_mask[problem.shared_columns]
        covariance = np.zeros((len(free), len(free)))
        covariance[np.ix_(free, free)] = np.linalg.pinv(self.information[np.ix_(free, free)], rcond=1e-13)
        return covariance


def compute_misfit(loss: ElementLoss, unknowns: Array, output_weights: OutputWeights) -> Misfit:
    """Return the unweighted misfit of a network."""
    squares, samples, points = np.zeros(4), 0.0, 0.0
    residuals = loss.compute_residuals(unknowns, output_weights)
    for b, (hysteresis, balance, force) in zip(loss.batches, residuals, strict=True):
        scale = b.point_weights / b.slip_velocity[:, None]
        velocity = b.motion[1] * scale
        parts = (
            force * b.sample_weights,
            hysteresis * scale,
            balance * b.point_weights,
            velocity - (velocity @ b.test_functions) @ b.test_functions.T,
        )
        squares += [float((part**2).sum()) for part in parts]
        samples += float((b.sample_weights**2).sum())
        points += float((b.point_weights**2).sum())
    return Misfit(*np.sqrt(squares / np.array([max(samples, 1.0), points, points, points])).tolist())
