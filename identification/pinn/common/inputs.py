"""Inputs of the network: motion, drive and field of one piece at any time.

Time is that of the displacement channel. The field follows the drive in closed form (eq. 8, for a drive that is
held between samples). The network does not have to learn it.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from identification.arrays import Array
from identification.fitting import Piece
from identification.simulate import filter_series

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
        self._field: tuple[float, tuple[Array, Array]] | None = None
        """Field at the samples for the last eta: every batch of elements of a piece asks for it."""
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
        if self._field is None or self._field[0] != eta:
            self._field = eta, _filter_drive(self._drive, eta, self.h)
        u, du_deta = self._field[1]
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
    a = np.array([1.0, -decay])
    # A coefficient of the sample before: the output begins one sample after the input.
    u = drive[0] + filter_series(np.array([0.0, 1.0 - decay]), a, drive - drive[0])
    du_deta = filter_series(np.array([0.0, -h * decay]), a, u - drive)
    return u, du_deta
