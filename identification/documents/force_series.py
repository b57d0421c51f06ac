"""Time series of recorded and simulated force, for plots and other tools."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from identification.arrays import Array, BoolArray
from identification.errors import IdentificationError


@dataclass(frozen=True)
class ForceSeries:
    """All samples of a prediction, stretch by stretch; arrays (N,)."""

    time: Array
    """Time on the log's clock [s]."""
    displacement: Array
    """Displacement, smoothed for the simulation [m]."""
    velocity: Array
    """Velocity [m/s]."""
    drive: Array
    """Drive [V or A]."""
    force: Array
    """Recorded force [N]."""
    simulated: Array
    """Simulated force [N]."""
    stretch: npt.NDArray[np.int64]
    """Index of the stretch in ``names``."""
    held_out: BoolArray
    """True where the sample was not fitted."""
    names: tuple[str, ...]
    drive_unit: str
    band: tuple[Array, Array] | None = None
    """Lower and upper end of the 95 % band of the recorded force [N]; None if unknown."""
    physics: Array | None = None
    """Simulated force without the learned residual of a twin [N]; None where it has none."""


_COLUMNS = {
    "time": "time_s",
    "displacement": "displacement_m",
    "velocity": "velocity_mps",
    "force": "force_n",
    "simulated": "simulated_force_n",
}


def write_force_series(path: Path, series: ForceSeries) -> None:
    """Write a series as .npz (arrays and an ``info`` JSON text) or .csv (units in the header).

    Raises:
        IdentificationError: the suffix is another one, or the file cannot be written.
    """
    try:
        if path.suffix == ".npz":
            _write_arrays(path, series)
        elif path.suffix == ".csv":
            _write_table(path, series)
        else:
            raise IdentificationError(f"{path}: a series is written as .npz or .csv; choose one of these suffixes")
    except OSError as error:
        raise IdentificationError(f"{path}: cannot be written ({error.strerror}); choose another place") from error


def _write_arrays(path: Path, series: ForceSeries) -> None:
    info = json.dumps({"stretches": list(series.names), "drive_unit": series.drive_unit})
    names = ("time", "displacement", "velocity", "drive", "force", "simulated", "stretch", "held_out")
    arrays = {name: getattr(series, name) for name in names}
    if series.band is not None:
        arrays |= {"lower": series.band[0], "upper": series.band[1]}
    if series.physics is not None:
        arrays |= {"physics": series.physics}
    np.savez_compressed(path, info=np.array(info), **arrays)


def _write_table(path: Path, series: ForceSeries) -> None:
    drive = "voltage_v" if series.drive_unit == "V" else "current_a"
    columns = {header: getattr(series, name) for name, header in _COLUMNS.items()} | {drive: series.drive}
    if series.band is not None:
        columns |= {"lower_force_n": series.band[0], "upper_force_n": series.band[1]}
    if series.physics is not None:
        columns |= {"physics_force_n": series.physics}
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns),
        comments="",
        fmt="%.9g",
    )
