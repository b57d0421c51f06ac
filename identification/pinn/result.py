"""What a training answers."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates, to_parameters
from identification.damper.parameters import Parameters
from identification.problem import COORDINATE_COUNT
from identification.simulate import ActiveEffect


class Moment(NamedTuple):
    """Where a training stood."""

    seconds: float
    """[s] of processor time since its start."""
    phase: str
    force: float
    """[N] root mean square misfit of the network's own force on its training samples."""
    hysteresis: float
    """[1] root mean square residual of eq. 3 over the usual velocity."""
    balance: float
    """[N] root mean square residual of eq. 4."""


class Errors(NamedTuple):
    """Root mean square force errors [N]."""

    train: float
    """In the end, on what was never set aside."""
    validation: float | None
    """On the blocks set aside, before they were taken back; None where there are none."""


@dataclass(frozen=True)
class Outcome:
    """What one of the networks found."""

    unknowns: Array
    """(C,) search numbers, delays in units of their prior, effects, what logs have of their own."""
    covariance: Array | None
    """(C, C) of them from the last factorisation; None where the method gives none."""
    forces: tuple[Array, ...]
    """(N,) of each piece: the network's own force [N], as the channel records it; NaN where it knows nothing."""
    accepted: bool
    """Whether the force reached the noise and the law is kept."""
    note: str
    """How it ended, in words."""
    steps: int
    history: tuple[Moment, ...]


@dataclass(frozen=True)
class PinnResult:
    """Parameters found by training, with both of its faces: the network's own force, and the law's."""

    network: str
    coordinates: Coordinates
    unknowns: Array
    """(C,) shared by all pieces: search numbers, delays in units of their prior, effects, what logs have of their
    own."""
    covariance: Array | None
    """(C, C) of them; None where there is none."""
    coordinate_covariance: Array | None
    """(13, 13)"""
    delays: tuple[float, float]
    """[s] of force and drive channel, beyond what the instruments report."""
    effects: tuple[ActiveEffect, ...]
    """What acts beside the law."""
    effect_deviations: Array
    """(P,) standard deviations [SI] of their parameters, one effect after the other; NaN where none are known."""
    reconstruction: Errors
    """The network's own force. It says little of the parameters."""
    simulation: Errors
    """The law simulated with the parameters: the honest figure."""
    reconstructed: tuple[Array, ...]
    """(N,) of each piece [N]."""
    simulated: tuple[Array, ...]
    accepted: bool
    note: str
    steps: int
    seconds: float
    history: tuple[Moment, ...] = field(repr=False)

    @property
    def parameters(self) -> Parameters:
        """The paper's fourteen, A at its usual gauge."""
        return to_parameters(self.coordinates)

    @property
    def deviations(self) -> Array:
        """(13,) standard deviations of the coordinates; NaN where none are known."""
        if self.coordinate_covariance is None:
            return np.full(COORDINATE_COUNT, np.nan)
        return np.sqrt(np.maximum(np.diag(self.coordinate_covariance), 0.0))
