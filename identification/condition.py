"""What a log has of its own, when several logs of one specimen are fitted together.

A damper recorded on several days is the same damper, but its oil was warmer on one of them and the load cell had
another zero. So each log behind the first may have an offset of the force, and a factor of all damping (c0 and
c1), as the viscosity changes with temperature.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates

_DAMPING = ("c0_a", "c0_b", "c1_a", "c1_b")
_COLUMNS = [Coordinates._fields.index(name) for name in _DAMPING]
_F0 = Coordinates._fields.index("f0")
_OFFSET = 20.0
"""[N] standard deviation of a log's offset beforehand: zeros and preload between two days."""
_VISCOSITY = 0.3
"""[1] standard deviation of the logarithm of a log's damping beforehand: some 20 K."""


@dataclass(frozen=True)
class Condition:
    """How one log differs from the first."""

    offset: float = 0.0
    """[N] by which its preload f0 is larger."""
    viscosity: float = 1.0
    """[1] factor of its c0 and c1."""

    @staticmethod
    def at(unknowns: Mapping[str, float]) -> "Condition":
        """The condition at a point of the search: each unknown in its standard deviations beforehand."""
        return Condition(
            _OFFSET * float(unknowns.get("offset", 0.0)),
            float(np.exp(_VISCOSITY * float(unknowns.get("viscosity", 0.0)))),
        )

    def of(self, shared: Coordinates) -> Coordinates:
        """The damper as this log shows it."""
        if self == SAME:
            return shared
        damping = {name: getattr(shared, name) * self.viscosity for name in _DAMPING}
        return shared._replace(f0=shared.f0 + self.offset, **damping)

    def chained(self, slopes: Array) -> Array:
        """Slopes (N, U) over the shared coordinates, from those over this log's."""
        if self.viscosity != 1.0:
            slopes = slopes.copy()
            slopes[:, _COLUMNS] *= self.viscosity
        return slopes


SAME = Condition()
"""Of the first log."""


@dataclass(frozen=True)
class Own:
    """One thing that a log may have of its own."""

    meaning: str
    slopes: Callable[[Coordinates], Array]
    """(13,) change of the shared coordinates that one deviation of the unknown is worth."""
    value: Callable[[float, float], tuple[float, float]]
    """Value and standard deviation in ``unit`` from those of the unknown."""
    unit: str


def _offset_slopes(shared: Coordinates) -> Array:
    slopes = np.zeros(len(shared))
    slopes[_F0] = _OFFSET
    return slopes


def _viscosity_slopes(shared: Coordinates) -> Array:
    slopes = np.zeros(len(shared))
    slopes[_COLUMNS] = _VISCOSITY * np.array(shared)[_COLUMNS]
    return slopes


def _offset_value(unknown: float, deviation: float) -> tuple[float, float]:
    return _OFFSET * unknown, _OFFSET * deviation


def _viscosity_value(unknown: float, deviation: float) -> tuple[float, float]:
    factor = float(np.exp(_VISCOSITY * unknown))
    return factor, factor * _VISCOSITY * deviation


OWN: dict[str, Own] = {
    "offset": Own("preload and zero of the load cell, beyond the first log's", _offset_slopes, _offset_value, "N"),
    "viscosity": Own("factor of c0 and c1 against the first log", _viscosity_slopes, _viscosity_value, "1"),
}
"""What may be asked for, by name."""
