"""Recorded and simulated force of a run, as a job has stored them, and the force error of each segment."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt
from pydantic import Field

from bench.errors import LogError
from bench.samples import SegmentRange
from bench.validation import FrozenModel

_NAMES = ("displacement", "velocity", "drive", "force", "simulated")
Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ForceSeries:
    """Series of a simulation on a recording; arrays (N,)."""

    time: Array
    """Time since the first sample of the run [s]."""
    columns: dict[str, Array]
    """Displacement [m], velocity [m/s], drive [V or A], recorded and simulated force [N]."""
    held_out: npt.NDArray[np.bool_]
    """True where no fit has read the sample."""
    half_width: Array | None
    """Half-width of the 95 % band of the recorded force [N]; None if it is not known."""
    drive_unit: str


class StrokeError(FrozenModel):
    """Force error of a simulation on one segment."""

    segment: str = Field(description="name of the segment")
    start_s: float = Field(description="[s] since the first sample of the run")
    stop_s: float = Field(description="[s] since the first sample of the run")
    amplitude_m: float | None = Field(description="[m]")
    frequency_hz: float | None = Field(description="[Hz]")
    drive_value: float | None = Field(description="[V or A]; null if the drive varies")
    rmse_n: float = Field(description="root mean square force error [N]")
    bias_n: float = Field(description="mean of simulated minus recorded force [N]")
    samples: int
    held_out: bool = Field(description="whether no fit has read most of these samples")


def read_force_series(path: Path) -> ForceSeries:
    """Read the series that `mrbench predict --series` or a job has written.

    Raises:
        LogError: the file cannot be read, or is another one.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            band = file["upper"] - file["lower"] if "upper" in file else None
            return ForceSeries(
                time=file["time"],
                columns={name: file[name] for name in _NAMES},
                held_out=file["held_out"],
                half_width=None if band is None else band / 2,
                drive_unit=str(json.loads(str(file["info"]))["drive_unit"]),
            )
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise LogError(f"{path}: not a series of `mrbench predict` ({error}); request the fit again") from error


def find_stroke_errors(series: ForceSeries, segments: Sequence[SegmentRange]) -> list[StrokeError]:
    """Return the force error of each segment of which the series has samples."""
    return [error for one in segments if (error := _find_error(series, one)) is not None]


def _find_error(series: ForceSeries, segment: SegmentRange) -> StrokeError | None:
    first, last = np.searchsorted(series.time, [segment.start_s - 1e-6, segment.stop_s + 1e-6])
    if last <= first:
        return None
    part = slice(int(first), int(last))
    error = series.columns["simulated"][part] - series.columns["force"][part]
    return StrokeError(
        segment=segment.name,
        start_s=segment.start_s,
        stop_s=segment.stop_s,
        amplitude_m=segment.amplitude_m,
        frequency_hz=segment.frequency_hz,
        drive_value=segment.drive_value,
        rmse_n=float(np.sqrt(np.mean(error**2))),
        bias_n=float(error.mean()),
        samples=len(error),
        held_out=bool(series.held_out[part].mean() > 0.5),
    )
