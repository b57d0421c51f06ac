"""Average over the cycles of a stroke by phase: repeating and scattering part of the residual.

A damper responds to a repeated stroke with a repeated force. The part of the residual that all cycles share is an
error of the law. The part that differs from cycle to cycle is noise, drift and stick-slip.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.common.prediction_series import PredictionSeries

POINTS = 360
"""Number of phases in a cycle; phase 0 is the upward passage of the middle, 90 degrees the upper reversal."""
_ARMING_DEPTH = 0.3
"""Depth below the middle over the amplitude [1]; the next upward passage counts only after it was reached."""
_MAX_TRAVEL_CHANGE = 0.03
"""Largest relative difference of a cycle's travel from the median [1]; excludes the ramps at start and stop."""
_REVERSAL_PHASES = ((75, 135), (255, 315))
"""Phases [degree] from just before each reversal until the force has changed its sign."""


@dataclass(frozen=True)
class Cycles:
    """Steady cycles of a stroke, (cycles, POINTS) each."""

    displacement: np.ndarray
    """Displacement [m]."""
    velocity: np.ndarray
    """Velocity [m/s]."""
    force: np.ndarray
    """Recorded force [N]."""
    simulated: np.ndarray
    """Simulated force [N]."""

    @property
    def residual(self) -> np.ndarray:
        """Recorded minus simulated force [N]."""
        return np.asarray(self.force - self.simulated)

    @property
    def mean_residual(self) -> np.ndarray:
        """Residual that all cycles share [N], (POINTS,)."""
        return np.asarray(self.residual.mean(axis=0))

    @property
    def repeating_rms(self) -> float:
        """Root mean square [N] of the residual that all cycles share."""
        return float(np.sqrt(np.mean(self.mean_residual**2)))

    @property
    def scatter(self) -> float:
        """Standard deviation [N] of the residual from its mean over the cycles."""
        return float(np.sqrt(np.mean(np.var(self.residual, axis=0, ddof=1))))

    @property
    def reversal_share(self) -> float:
        """Fraction [1] of the repeating squared residual at the two reversals, which are a third of the cycle."""
        degree = 360.0 * np.arange(POINTS) / POINTS
        near = np.any([(degree >= low) & (degree < high) for low, high in _REVERSAL_PHASES], axis=0)
        return float(np.sum(self.mean_residual[near] ** 2) / np.sum(self.mean_residual**2))

    @property
    def plateau_excess(self) -> float:
        """Mean excess of the damper's resistance over that of the law at high speed [N]; negative if smaller."""
        velocity = self.velocity.mean(axis=0)
        fast = np.abs(velocity) > 0.8 * np.abs(velocity).max()
        return float(np.mean((np.sign(velocity) * self.mean_residual)[fast]))


def find_cycles(series: PredictionSeries, name: str) -> Cycles:
    """Return the steady cycles of one stretch of a series."""
    rows = series.select_rows(name)
    x = series.displacement[rows]
    starts = _find_upward_crossings(x)
    travel = np.array([np.ptp(x[int(a) : int(b) + 1]) for a, b in pairwise(starts)])
    steady = np.flatnonzero(np.abs(travel / np.median(travel) - 1.0) < _MAX_TRAVEL_CHANGE)
    phase = np.arange(POINTS) / POINTS
    positions = starts[steady, None] + (starts[steady + 1] - starts[steady])[:, None] * phase
    columns = ("displacement", "velocity", "force", "simulated")
    return Cycles(*(np.interp(positions, np.arange(len(x)), getattr(series, c)[rows]) for c in columns))


def _find_upward_crossings(x: np.ndarray) -> np.ndarray:
    """Return the fractional sample indices at which a displacement (N,) passes its middle upwards."""
    centred = x - 0.5 * (np.percentile(x, 99) + np.percentile(x, 1))
    limit = -_ARMING_DEPTH * 0.5 * float(np.ptp(centred))
    found, armed = [], False
    for i in range(1, len(x)):
        armed = armed or centred[i] < limit
        if armed and centred[i - 1] < 0.0 <= centred[i]:
            found.append(i - 1 + centred[i - 1] / (centred[i - 1] - centred[i]))
            armed = False
    return np.array(found)
