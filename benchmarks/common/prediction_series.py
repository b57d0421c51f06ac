"""What `mrbench predict --series` writes, read back."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class PredictionSeries:
    """Recorded and simulated force of every stretch of a log, (N,) each."""

    time: np.ndarray
    """[s]"""
    displacement: np.ndarray
    """[m]"""
    velocity: np.ndarray
    """[m/s]"""
    drive: np.ndarray
    """[V or A]"""
    force: np.ndarray
    """[N] recorded."""
    simulated: np.ndarray
    """[N]"""
    stretch: np.ndarray
    """Number of the stretch in ``names``."""
    held_out: np.ndarray
    """True where the fit did not see the sample."""
    names: Sequence[str]

    @property
    def residual(self) -> np.ndarray:
        """Recorded minus simulated force [N]."""
        return self.force - self.simulated

    def select_rows(self, name: str) -> np.ndarray:
        """(N,) True in one stretch."""
        return np.asarray(self.stretch == self.names.index(name))

    def compute_error(self, rows: np.ndarray) -> tuple[float, float]:
        """RMSE [N] and NRMSE [1] of the samples chosen."""
        rmse = float(np.sqrt(np.mean(self.residual[rows] ** 2)))
        return rmse, rmse / float(self.force[rows].std())


def read_series(path: Path) -> PredictionSeries:
    """A series from its .npz file."""
    columns = ("time", "displacement", "velocity", "drive", "force", "simulated", "stretch", "held_out")
    with np.load(path) as file:
        names = json.loads(str(file["info"]))["stretches"]
        return PredictionSeries(*(file[name] for name in columns), names=names)
