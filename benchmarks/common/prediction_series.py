"""Force series that ``mrbench predict --series`` writes."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class PredictionSeries:
    """Recorded and simulated force of every stretch of a log, (N,) each."""

    time: np.ndarray
    """Time [s]."""
    displacement: np.ndarray
    """Displacement [m]."""
    velocity: np.ndarray
    """Velocity [m/s]."""
    drive: np.ndarray
    """Drive [V or A]."""
    force: np.ndarray
    """Recorded force [N]."""
    simulated: np.ndarray
    """Simulated force [N]."""
    stretch: np.ndarray
    """Number of the stretch in ``names``."""
    held_out: np.ndarray
    """True for held-out samples."""
    names: Sequence[str]
    """Names of the stretches."""

    @property
    def residual(self) -> np.ndarray:
        """Recorded minus simulated force [N]."""
        return np.asarray(self.force - self.simulated)

    def select_rows(self, name: str) -> np.ndarray:
        """Return a mask (N,) of the samples of one stretch."""
        return np.asarray(self.stretch == self.names.index(name))

    def compute_error(self, rows: np.ndarray) -> tuple[float, float]:
        """Compute RMSE [N] and NRMSE [1] of the selected samples."""
        rmse = float(np.sqrt(np.mean(self.residual[rows] ** 2)))
        return rmse, rmse / float(self.force[rows].std())


def read_series(path: Path) -> PredictionSeries:
    """Read a series from its .npz file."""
    columns = ("time", "displacement", "velocity", "drive", "force", "simulated", "stretch", "held_out")
    with np.load(path) as file:
        names = json.loads(str(file["info"]))["stretches"]
        return PredictionSeries(**{name: file[name] for name in columns}, names=names)
