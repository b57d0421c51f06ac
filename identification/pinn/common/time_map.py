"""Time maps: input of the network within one element, finest at the breakthrough of the hysteresis.

After a reversal z stays constant for a while and then passes from one saturation to the other within a fraction of
the half stroke. The breakthrough comes when the slip has reached about 1.3 yield displacements. The input is
asinh((t - centre) / width), which is continuous in time and finest there. Centre and width follow the network's
own slip and are computed again for every mesh.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.pinn.common.reversals import integrate_slip

_ENTRY_SLIP, _CENTRE_SLIP, _EXIT_SLIP = 0.7, 1.3, 2.0
"""Slip since the reversal over the yield displacement [1] at begin, centre and end of the breakthrough."""
_MAX_SLIP_SHARE = 0.9
"""Fraction of an element's slip [1] at which the breakthrough ends at the latest."""
_LINEAR_WIDTH = 5.0
"""Width over an element's length [1] with which the map is linear to a hundredth."""
_MIN_WIDTH = 5e-4
"""Smallest width [s]; recordings do not resolve less."""
_SLIP_POINTS = 150
"""Number of points at which the slip velocity in an element is evaluated."""


@dataclass(frozen=True)
class TimeMap:
    """Monotonic map of the time in an element onto 0..1."""

    length: float
    """Length of the element [s]."""
    centre: float
    """Time of the breakthrough after the element's start [s]."""
    width: float
    """Duration of the breakthrough [s]."""

    def evaluate(self, time: Array) -> tuple[Array, Array, Array]:
        """Return input [1], its rate [1/s] and the derivative of the rate [1/s²] at times [s] after the start."""
        low, span = self._compute_range()
        scaled = (time - self.centre) / self.width
        root = np.sqrt(1.0 + scaled**2)
        rate = 1.0 / (span * self.width * root)
        return (np.arcsinh(scaled) - low) / span, rate, -rate * scaled / (self.width * root**2)

    def invert(self, value: Array) -> Array:
        """Return the time [s] after the start at inputs in 0..1."""
        low, span = self._compute_range()
        return np.asarray(self.centre + self.width * np.sinh(low + span * value))

    def _compute_range(self) -> tuple[float, float]:
        low = float(np.arcsinh(-self.centre / self.width))
        return low, float(np.arcsinh((self.length - self.centre) / self.width)) - low


def make_slip_times(length: float) -> Array:
    """Return times (N,) [s] in an element for its slip velocity, denser after the reversal at its start."""
    return np.asarray(length * np.linspace(0.0, 1.0, _SLIP_POINTS) ** 1.5)


def make_reversal_map(length: float, time: Array, slip_velocity: Array, yield_displacement: float) -> TimeMap:
    """Return the map of an element that begins at a reversal.

    Args:
        length: length of the element [s].
        time: times (N,) after its start [s].
        slip_velocity: slip velocity (N,) at these times [m/s].
        yield_displacement: yield displacement [m].
    """
    slip = integrate_slip(time, np.abs(slip_velocity))
    # A damper that hardly slips turns over the slip that there is.
    turn = min(yield_displacement, _MAX_SLIP_SHARE * float(slip[-1]) / _EXIT_SLIP)
    entry, centre, end = np.interp(np.array([_ENTRY_SLIP, _CENTRE_SLIP, _EXIT_SLIP]) * turn, slip, time)
    return TimeMap(length, float(centre), max(float(end - entry), _MIN_WIDTH))


def make_step_map(length: float, eta: float) -> TimeMap:
    """Return the map of an element that begins at a drive step: finest while the field settles (eta [1/s])."""
    return TimeMap(length, 0.0, max(1.0 / eta, _MIN_WIDTH))


def make_default_map(length: float) -> TimeMap:
    """Return the map of an element that begins at neither a reversal nor a drive step."""
    return TimeMap(length, 0.0, length)


def make_linear_map(length: float) -> TimeMap:
    """Return a map that is linear to a hundredth; a research option for ablations."""
    return TimeMap(length, 0.0, _LINEAR_WIDTH * length)
