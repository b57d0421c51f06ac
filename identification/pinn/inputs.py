"""What drives the network: motion and field of one recording, at any time.

Time is the displacement channel's own. The field follows the drive in closed form (eq. 8 over a drive that is
held between samples), so that no network has to learn it.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import lfilter

from identification.arrays import Array
from identification.piece import Piece

_STEP = 0.02
"""[1] of the drive's range: a larger change between two samples is a step."""


class Field(NamedTuple):
    """Field behind the drive at some times, (N,) each."""

    u: Array
    """[V or A]"""
    over_eta: Array
    """Its slope over eta."""
    over_delay: Array
    """Its slope over the drive's delay."""


class Inputs:
    """Motion and drive of a piece."""

    def __init__(self, piece: Piece) -> None:
        stroke = piece.stroke
        self.h = 1.0 / stroke.rate
        self.duration = (len(stroke.drive) - 1) * self.h
        time = np.arange(len(stroke.drive)) * self.h
        self._x = CubicHermiteSpline(time, stroke.displacement, stroke.velocity)
        self._v = CubicHermiteSpline(time, stroke.velocity, stroke.acceleration)
        self._drive = stroke.drive
        self.usual_velocity = float(np.sqrt(np.mean(stroke.velocity**2)))
        """[m/s] root mean square."""

    def motion(self, time: Array) -> tuple[Array, Array]:
        """Displacement [m] and velocity [m/s] at some times [s]."""
        inside = np.clip(time, 0.0, self.duration)
        return np.asarray(self._x(inside)), np.asarray(self._v(inside))

    def field(self, time: Array, eta: float, delay: float) -> Field:
        """Field at some times [s], the drive arriving ``delay`` [s] late."""
        u, slopes = _settling(self._drive, eta, self.h)
        place = np.clip((time - delay) / self.h, 0.0, len(u) - 1.0)
        i = np.minimum(place.astype(np.int64), len(u) - 2)
        since, held = (place - i) * self.h, self._drive[i]
        fade = np.exp(-eta * since)
        now = held + (u[i] - held) * fade
        over_eta = slopes[i] * fade - since * (u[i] - held) * fade
        return Field(now, over_eta, eta * (now - held))

    def drive(self, time: Array, delay: float) -> Array:
        """The drive [V or A] itself, held between samples."""
        place = np.clip((time - delay) / self.h, 0.0, len(self._drive) - 1.0)
        return self._drive[place.astype(np.int64)]

    def steps(self, delay: float, apart: float) -> Array:
        """Times [s] at which the drive jumps, the first of any that follow each other within ``apart`` [s]."""
        jumps = np.abs(np.diff(self._drive)) > max(_STEP * float(np.ptp(self._drive)), 1e-12)
        found: list[float] = []
        for time in (np.flatnonzero(jumps) + 1) * self.h + delay:
            if not found or time - found[-1] > apart:
                found.append(float(time))
        return np.array(found)


def _settling(drive: Array, eta: float, h: float) -> tuple[Array, Array]:
    """Field (N,) at the samples of a held drive (N,), settled at the first, and its slope over eta."""
    fade = float(np.exp(-eta * h))
    kept = [1.0, -fade]
    u = drive[0] + np.concatenate([[0.0], lfilter([1.0 - fade], kept, drive[:-1] - drive[0])])
    over_eta = np.concatenate([[0.0], lfilter([-h * fade], kept, u[:-1] - drive[:-1])])
    return u, over_eta
