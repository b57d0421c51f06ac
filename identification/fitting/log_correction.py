"""Per-log parameters in a fit of several logs of one specimen.

Between two days the oil temperature changes, and so does the zero of the load cell. Each log after the first may
therefore have a force offset, and a factor on all damping (c0 and c1) for the viscosity.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates

_DAMPING_COORDINATES = ("c0_a", "c0_b", "c1_a", "c1_b")
_DAMPING_COLUMNS = [Coordinates._fields.index(name) for name in _DAMPING_COORDINATES]
_F0 = Coordinates._fields.index("f0")
_OFFSET_PRIOR = 20.0
"""Prior standard deviation [N] of a log's offset: changes of zero and preload between two days."""
_VISCOSITY_PRIOR = 0.3
"""Prior standard deviation of the logarithm of a log's damping factor; it corresponds to some 20 K."""


@dataclass(frozen=True)
class LogCorrection:
    """Difference between one log's damper and that of the first log."""

    offset: float = 0.0
    """Force added to the preload f0 [N]."""
    viscosity: float = 1.0
    """Factor on c0 and c1 (dimensionless)."""

    @staticmethod
    def from_unknowns(unknowns: Mapping[str, float]) -> "LogCorrection":
        """Return the correction of unknowns, which are in prior standard deviations."""
        return LogCorrection(
            _OFFSET_PRIOR * float(unknowns.get("offset", 0.0)),
            float(np.exp(_VISCOSITY_PRIOR * float(unknowns.get("viscosity", 0.0)))),
        )

    def apply(self, shared: Coordinates) -> Coordinates:
        """Return the coordinates of this log's damper."""
        if self == NO_CORRECTION:
            return shared
        damping = {name: getattr(shared, name) * self.viscosity for name in _DAMPING_COORDINATES}
        return shared._replace(f0=shared.f0 + self.offset, **damping)

    def apply_chain_rule(self, sensitivities: Array) -> Array:
        """Return sensitivities (N, U) over the shared coordinates, from those over this log's."""
        if self.viscosity != 1.0:
            sensitivities = sensitivities.copy()
            sensitivities[:, _DAMPING_COLUMNS] *= self.viscosity
        return sensitivities


NO_CORRECTION = LogCorrection()
"""Correction of the first log."""


@dataclass(frozen=True)
class PerLogParameter:
    """A quantity that each log after the first may have individually."""

    meaning: str
    differentiate: Callable[[Coordinates], Array]
    """Derivative (13,) of the shared coordinates over the unknown."""
    value: Callable[[float, float], tuple[float, float]]
    """Function from value and standard deviation of the unknown to those in ``unit``."""
    unit: str


def _differentiate_offset(shared: Coordinates) -> Array:
    derivative = np.zeros(len(shared))
    derivative[_F0] = _OFFSET_PRIOR
    return derivative


def _differentiate_viscosity(shared: Coordinates) -> Array:
    derivative = np.zeros(len(shared))
    derivative[_DAMPING_COLUMNS] = _VISCOSITY_PRIOR * np.array(shared)[_DAMPING_COLUMNS]
    return derivative


def _convert_offset(unknown: float, deviation: float) -> tuple[float, float]:
    return _OFFSET_PRIOR * unknown, _OFFSET_PRIOR * deviation


def _convert_viscosity(unknown: float, deviation: float) -> tuple[float, float]:
    factor = float(np.exp(_VISCOSITY_PRIOR * unknown))
    return factor, factor * _VISCOSITY_PRIOR * deviation


PER_LOG_PARAMETERS: dict[str, PerLogParameter] = {
    "offset": PerLogParameter(
        "preload and zero of the load cell, relative to the first log", _differentiate_offset, _convert_offset, "N"
    ),
    "viscosity": PerLogParameter(
        "factor on c0 and c1, relative to the first log", _differentiate_viscosity, _convert_viscosity, "1"
    ),
}
"""Per-log parameters by name."""
