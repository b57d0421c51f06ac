"""Strokes of one file laid over each other by phase: what repeats in the residual, and what does not.

The damper answers a repeated stroke with a repeated force. What the residual has in common over the cycles is
what the law lacks; what differs from cycle to cycle is noise, drift and stick-slip.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.common.prediction_series import PredictionSeries

POINTS = 360
"""Phases in a cycle: 0 where the displacement passes its middle upwards, 90 at the upper reversal."""
_ARMING_DEPTH = 0.3
"""[1] of the amplitude below the middle that must be reached before the next upward passage counts."""
_MAX_TRAVEL_CHANGE = 0.03
"""[1] largest difference of a cycle's travel from the median; the ramps at start and stop are left out."""
_REVERSAL_PHASES = ((75, 135), (255, 315))
"""[degree] from just before each reversal until the force has turned over."""


@dataclass(frozen=True)
class Cycles:
    """Steady cycles of a stroke, (cycles, POINTS) each."""

    displacement: np.ndarray
    """[m]"""
    velocity: np.ndarray
    """[m/s]"""
    force: np.ndarray
    """[N] recorded."""
    simulated: np.ndarray
    """[N]"""

    @property
    def residual(self) -> np.ndarray:
        """Recorded minus simulated force [N]."""
        return self.force - self.simulated

    @property
    def mean_residual(self) -> np.ndarray:
        """(POINTS,) residual that all cycles share [N]."""
        return np.asarray(self.residual.mean(axis=0))

    @property
    def repeating_rms(self) -> float:
        """Root mean square [N] of the residual that all cycles share."""
        return float(np.sqrt(np.mean(self.mean_residual**2)))

    @property
    def scatter(self) -> float:
        """Standard deviation [N] of the residual about what its cycles share."""
        return float(np.sqrt(np.mean(np.var(self.residual, axis=0, ddof=1))))

    @property
    def reversal_share(self) -> float:
        """[1] part of the shared squared residual that lies at the two reversals, a third of the cycle."""
        degree = 360.0 * np.arange(POINTS) / POINTS
        near = np.any([(degree >= low) & (degree < high) for low, high in _REVERSAL_PHASES], axis=0)
        return float(np.sum(self.mean_residual[near] ** 2) / np.sum(self.mean_residual**2))

    @property
    def plateau_excess(self) -> float:
        """[N] by which the damper resists more than the law while it moves fast; negative where less."""
        velocity = self.velocity.mean(axis=0)
        fast = np.abs(velocity) > 0.8 * np.abs(velocity).max()
        return float(np.mean((np.sign(velocity) * self.mean_residual)[fast]))


def find_cycles(series: PredictionSeries, name: str) -> Cycles:
    """The steady cycles of one stretch of a series."""
    rows = series.select_rows(name)
    x = series.displacement[rows]
    starts = _find_upward_crossings(x)
    travel = np.array([np.ptp(x[int(a) : int(b) + 1]) for a, b in pairwise(starts)])
    steady = np.flatnonzero(np.abs(travel / np.median(travel) - 1.0) < _MAX_TRAVEL_CHANGE)
    phase = np.arange(POINTS) / POINTS
    places = starts[steady, None] + (starts[steady + 1] - starts[steady])[:, None] * phase
    columns = ("displacement", "velocity", "force", "simulated")
    return Cycles(*(np.interp(places, np.arange(len(x)), getattr(series, c)[rows]) for c in columns))


def _find_upward_crossings(x: np.ndarray) -> np.ndarray:
    """Sample numbers, with fractions, at which a displacement (N,) passes its middle upwards."""
    centred = x - 0.5 * (np.percentile(x, 99) + np.percentile(x, 1))
    limit = -_ARMING_DEPTH * 0.5 * float(np.ptp(centred))
    found, armed = [], False
    for i in range(1, len(x)):
        armed = armed or centred[i] < limit
        if armed and centred[i - 1] < 0.0 <= centred[i]:
            found.append(i - 1 + centred[i - 1] / (centred[i - 1] - centred[i]))
            armed = False
    return np.array(found)
