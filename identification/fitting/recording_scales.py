"""Scales of a recording: its own units of force, length, velocity and time.

Bounds, starts and steps of a fit are stated in these units. A damper of 10 N and one of 400 kN are then the same
problem.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.damper import DamperSize
from identification.fitting.piece import Piece

_PEAK_QUANTILE = 0.995
"""Quantile of the speed that counts as its peak [1]: differentiated noise has larger values."""
_SLOW_ANGLE = 1000.0
"""Smallest time over which slow changes are observed, over half stroke divided by peak speed [1].

Within fewer strokes, a slow change could not be told from the strokes."""
_SMALLEST = 1e-12
"""Lower limit of a scale, in its unit: a recording at rest has none, and nothing may be divided by zero."""


@dataclass(frozen=True)
class RecordingScales:
    """Units in which a damper is sought."""

    force: float
    """Standard deviation of the fitted force [N]."""
    length: float
    """Half of the largest stroke [m]."""
    velocity: float
    """Peak speed [m/s]."""
    drive: float
    """Highest drive [V or A]; one where the drive is always zero."""
    sampling_rate: float
    """Highest sampling rate [Hz]."""
    duration: float
    """Time of the end of the last fitted sample since the start of its run [s]."""

    @property
    def damper_size(self) -> DamperSize:
        """Size of the damper, by which the ranges of effects are scaled."""
        observation_time = max(self.duration, _SLOW_ANGLE / self.rate)
        return DamperSize(self.force, self.length, self.velocity, self.drive, observation_time, self.duration)

    @property
    def rate(self) -> float:
        """Peak speed over half stroke [1/s]: the angular frequency of a sine of that stroke and speed."""
        return self.velocity / self.length

    @property
    def cycle_duration(self) -> float:
        """Duration of a cycle of that sine [s]."""
        return 2.0 * np.pi / self.rate

    @property
    def stiffness(self) -> float:
        """Unit of stiffness [N/m]."""
        return self.force / self.length

    @property
    def damping(self) -> float:
        """Unit of damping [N s/m]."""
        return self.force / self.velocity


def measure_scales(pieces: Sequence[Piece]) -> RecordingScales:
    """Measure the scales of the fitted samples of some pieces."""
    fitted = [(p, p.train > 0) for p in pieces if np.any(p.train > 0)]
    force = np.concatenate([p.force[used] for p, used in fitted])
    speed = np.abs(np.concatenate([p.excitation.velocity[used] for p, used in fitted]))
    strokes = [np.ptp(p.excitation.displacement[used]) for p, used in fitted]
    return RecordingScales(
        force=max(float(force.std()), _SMALLEST),
        length=max(float(max(strokes)) / 2.0, _SMALLEST),
        velocity=max(float(np.quantile(speed, _PEAK_QUANTILE)), _SMALLEST),
        drive=float(max(np.abs(p.excitation.drive[used]).max() for p, used in fitted)) or 1.0,
        sampling_rate=max(p.excitation.rate for p in pieces),
        duration=max(float(p.excitation.time[used][-1]) + 1.0 / p.excitation.rate for p, used in fitted),
    )
