"""The network's input within one element: time, stretched around where the hysteresis breaks through.

After a reversal z stands still for a while and then runs from one saturation to the other within a fraction of
the half stroke; the breakthrough comes when the slip has reached about 1.3 yield displacements. The input is
asinh((t - centre) / width), continuous in time and fine exactly there. Centre and width follow the network's own
slip and are refreshed with every mesh.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array

_ENTERS, _CENTRE, _LEAVES = 0.7, 1.3, 2.0
"""[1] slip since the reversal over the yield displacement."""
_REACHED = 0.9
"""[1] of the slip in an element, at which the breakthrough ends at the latest."""
_PLAIN = 5.0
"""[1] of an element, from which width on nothing is stretched."""
_NARROWEST = 5e-4
"""[s] no recording resolves less."""


@dataclass(frozen=True)
class MemoryInput:
    """A monotonous map of the time in an element onto 0..1."""

    length: float
    """[s] of the element."""
    centre: float
    """[s] after its start."""
    width: float
    """[s]"""

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Input [1] at times [s] after the start, its rate [1/s] and the rate of that [1/s²]."""
        low, span = self._range()
        place = (time - self.centre) / self.width
        root = np.sqrt(1.0 + place**2)
        rate = 1.0 / (span * self.width * root)
        return (np.arcsinh(place) - low) / span, rate, -rate * place / (self.width * root**2)

    def time(self, value: Array) -> Array:
        """Time [s] after the start at inputs in 0..1."""
        low, span = self._range()
        return np.asarray(self.centre + self.width * np.sinh(low + span * value))

    def _range(self) -> tuple[float, float]:
        low = float(np.arcsinh(-self.centre / self.width))
        return low, float(np.arcsinh((self.length - self.centre) / self.width)) - low


def after_reversal(length: float, time: Array, slip_velocity: Array, yield_displacement: float) -> MemoryInput:
    """The map for an element that begins at a reversal.

    Args:
        length: of the element [s].
        time: (N,) after its start [s].
        slip_velocity: (N,) there [m/s].
        yield_displacement: [m].
    """
    size = np.abs(slip_velocity)
    slip = np.concatenate([[0.0], np.cumsum(0.5 * (size[1:] + size[:-1]) * np.diff(time))])
    # Where the damper hardly slips at all, the loop turns over what slip there is.
    turn = min(yield_displacement, _REACHED * float(slip[-1]) / _LEAVES)
    enters, centre, leaves = np.interp(np.array([_ENTERS, _CENTRE, _LEAVES]) * turn, slip, time)
    return MemoryInput(length, float(centre), max(float(leaves - enters), _NARROWEST))


def after_step(length: float, eta: float) -> MemoryInput:
    """The map for an element that begins where the drive jumps: fine while the field [1/s] settles."""
    return MemoryInput(length, 0.0, max(1.0 / eta, _NARROWEST))


def anywhere(length: float) -> MemoryInput:
    """The map for an element that begins where nothing happens."""
    return MemoryInput(length, 0.0, length)


def plain(length: float) -> MemoryInput:
    """Time itself, to a hundredth."""
    return MemoryInput(length, 0.0, _PLAIN * length)
