"""Residual force of a twin: prediction from its document, with its uncertainty."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.documents import TwinResidual
from identification.residual.gaussian_process import Basis, Posterior
from identification.residual.passivity import limit_residual
from identification.residual.state import StateUnits, compute_state
from identification.simulate import Excitation


class ResidualForce(NamedTuple):
    """Residual force along an excitation."""

    force: Array
    """(N,) mean [N], limited so that law and residual stay passive."""
    deviation: Array
    """(N,) standard deviation of the residual [N], without what no residual predicts (``rest_n``)."""


@dataclass(frozen=True)
class LearnedResidual:
    """Residual that can be evaluated on any recording of the same damper."""

    document: TwinResidual

    @cached_property
    def units(self) -> StateUnits:
        """Units of its variables."""
        return StateUnits(*self.document.units.model_dump().values())

    def predict(self, excitation: Excitation, law_force: Array) -> ResidualForce:
        """Return the residual force along an excitation with the simulated force (N,) [N] of law and effects."""
        state = compute_state(excitation, law_force, self.units)
        scaled = np.column_stack([state[name] * rate for name, rate in self.document.rates.items()])
        basis = self._basis.evaluate(scaled)
        mean = basis @ self._posterior.weights
        variance = self._posterior.compute_variance(basis)
        limited = limit_residual(law_force, mean, excitation.velocity, excitation.rate)
        return ResidualForce(limited, self.document.prior_n * np.sqrt(variance))

    @cached_property
    def _basis(self) -> Basis:
        return Basis.make(np.array(self.document.points, float))

    @cached_property
    def _posterior(self) -> Posterior:
        count = len(self.document.factor)
        factor = np.zeros((count, count))
        for i, row in enumerate(self.document.factor):
            factor[i, : i + 1] = row
        return Posterior(np.array(self.document.weights, float), factor, self.document.ridge)
