"""Results of a training: its course, its outcome, and the outcome evaluated by simulation."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates, Parameters, to_parameters
from identification.fitting import COORDINATE_COUNT
from identification.simulate import ActiveEffect


class TrainingRecord(NamedTuple):
    """State of a training at one time."""

    seconds: float
    """Processor time since the start [s]."""
    phase: str
    """Stage of the training, as text for a person."""
    force: float
    """Root mean square misfit of the network's own force on its training samples [N]."""
    hysteresis: float
    """Root mean square residual of eq. 3 over a typical velocity [1]."""
    balance: float
    """Root mean square residual of eq. 4 [N]."""


class ForceErrors(NamedTuple):
    """Root mean square force errors [N]."""

    train: float
    """Error at the end of the training, on samples that were never set aside."""
    validation: float | None
    """Error on the blocks set aside, before they were fitted; None without such blocks."""


@dataclass(frozen=True)
class TrainingOutcome:
    """Result of one network's training."""

    unknowns: Array
    """Shared unknowns (C,): search coordinates, delays over their prior, effect parameters, per-log parameters."""
    covariance: Array | None
    """Covariance (C, C) of the shared unknowns from the last factorisation; None if the method yields none."""
    forces: tuple[Array, ...]
    """The network's own force [N] (N,) of each piece, as the channel records it; NaN outside the learned span."""
    accepted: bool
    """True if the force reaches the noise and the law is satisfied."""
    note: str
    """End of the training, as text for a person."""
    steps: int
    history: tuple[TrainingRecord, ...]


@dataclass(frozen=True)
class PinnResult:
    """Parameters found by training, with the errors of the network's own force and of the simulated law."""

    network: str
    coordinates: Coordinates
    unknowns: Array
    """Shared unknowns (C,)."""
    covariance: Array | None
    """Covariance (C, C) of the shared unknowns; None if the method yields none."""
    coordinate_covariance: Array | None
    """Covariance (13, 13) of the coordinates."""
    delays: tuple[float, float]
    """Residual delays of force and drive [s]."""
    effects: tuple[ActiveEffect, ...]
    """Effects that were learned with the law."""
    effect_deviations: Array
    """Standard deviations (P,) of the effect parameters [SI], effect after effect; NaN where unknown."""
    reconstruction: ForceErrors
    """Errors of the network's own force; they contain little information on the parameters."""
    simulation: ForceErrors
    """Errors of the law, simulated with the parameters; these predict the error on other strokes."""
    reconstructed_force: tuple[Array, ...]
    """The network's own force [N] (N,) of each piece."""
    simulated_force: tuple[Array, ...]
    """Simulated force [N] (N,) of each piece."""
    accepted: bool
    note: str
    steps: int
    seconds: float
    history: tuple[TrainingRecord, ...] = field(repr=False)

    @property
    def parameters(self) -> Parameters:
        """The paper's fourteen parameters, in the usual gauge of A."""
        return to_parameters(self.coordinates)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the coordinates (13,); NaN where unknown."""
        if self.coordinate_covariance is None:
            return np.full(COORDINATE_COUNT, np.nan)
        return np.sqrt(np.maximum(np.diag(self.coordinate_covariance), 0.0))
