"""Inputs of the network: motion, drive and field of one piece at any time.

Time is that of the displacement channel. The field follows the drive in closed form (eq. 8, for a drive that is
held between samples). The network does not have to learn it.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import lfilter

from identification.arrays import Array
from identification.fitting import Piece

_DRIVE_STEP = 0.02
"""Threshold on the change of the drive between two samples, over its range [1]: a larger one is a step."""


class FieldSamples(NamedTuple):
    """Field at some times with its derivatives, (N,) each."""

    u: Array
    """Field [V or A]."""
    du_deta: Array
    """Derivative over eta."""
    du_ddelay: Array
    """Derivative over the drive's delay."""


class PieceInputs:
    """Motion, drive and field of a piece as functions of time."""

    def __init__(self, piece: Piece) -> None:
        excitation = piece.excitation
        self.h = 1.0 / excitation.rate
        self.duration = (len(excitation.drive) - 1) * self.h
        time = np.arange(len(excitation.drive)) * self.h
        self._x = CubicHermiteSpline(time, excitation.displacement, excitation.velocity)
        self._v = CubicHermiteSpline(time, excitation.velocity, excitation.acceleration)
        self._drive = excitation.drive
        self.rms_velocity = float(np.sqrt(np.mean(excitation.velocity**2)))
        """Root mean square velocity [m/s]."""

    def evaluate_motion(self, time: Array) -> tuple[Array, Array]:
        """Return displacement [m] and velocity [m/s] at times [s]."""
        inside = np.clip(time, 0.0, self.duration)
        return np.asarray(self._x(inside)), np.asarray(self._v(inside))

    def evaluate_acceleration(self, time: Array) -> Array:
        """Return the acceleration [m/s²] at times [s], as the difference of velocities one sample apart."""
        after, before = self.evaluate_motion(time + 0.5 * self.h)[1], self.evaluate_motion(time - 0.5 * self.h)[1]
        return np.asarray((after - before) / self.h)

    def evaluate_field(self, time: Array, eta: float, delay: float) -> FieldSamples:
        """Return the field at times [s] for a drive that is ``delay`` [s] late."""
        u, du_deta = _filter_drive(self._drive, eta, self.h)
        position = np.clip((time - delay) / self.h, 0.0, len(u) - 1.0)
        i = np.minimum(position.astype(np.int64), len(u) - 2)
        since, drive = (position - i) * self.h, self._drive[i]
        decay = np.exp(-eta * since)
        field = drive + (u[i] - drive) * decay
        field_deta = du_deta[i] * decay - since * (u[i] - drive) * decay
        return FieldSamples(field, field_deta, eta * (field - drive))

    def evaluate_drive(self, time: Array, delay: float) -> Array:
        """Return the drive [V or A] at times [s], held between samples and ``delay`` [s] late."""
        position = np.clip((time - delay) / self.h, 0.0, len(self._drive) - 1.0)
        return self._drive[position.astype(np.int64)]

    def find_drive_steps(self, delay: float, min_distance: float) -> Array:
        """Return times [s] of drive steps; of steps within ``min_distance`` [s], only the first."""
        steps = np.abs(np.diff(self._drive)) > max(_DRIVE_STEP * float(np.ptp(self._drive)), 1e-12)
        times: list[float] = []
        for time in (np.flatnonzero(steps) + 1) * self.h + delay:
            if not times or time - times[-1] > min_distance:
                times.append(float(time))
        return np.array(times)


def _filter_drive(drive: Array, eta: float, h: float) -> tuple[Array, Array]:
    """Return field (N,) and its derivative over eta at the samples of a held drive (N,); it starts settled."""
    decay = float(np.exp(-eta * h))
    denominator = [1.0, -decay]
    u = drive[0] + np.concatenate([[0.0], lfilter([1.0 - decay], denominator, drive[:-1] - drive[0])])
    du_deta = np.concatenate([[0.0], lfilter([-h * decay], denominator, u[:-1] - drive[:-1])])
    return u, du_deta
