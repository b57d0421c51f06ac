"""Recording for the plots: samples on one time base, with the simulated force if a fit was given."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.errors import ReportError
from bench.log import Log, LoggedSegment
from bench.report.series import ForceSeries

Array = npt.NDArray[np.float64]

_CHANNELS = ("displacement", "velocity", "force", "coil_drive")
"""Channels that the plots need."""


@dataclass(frozen=True)
class Recording:
    """Samples of one log; arrays have shape (N,)."""

    time: Array
    """Time [s] since the first sample of the log."""
    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    drive: Array
    """[V or A]"""
    force: Array
    """Recorded force [N]."""
    simulated: Array | None
    """Simulated force [N]; None without a fit."""
    held_out: npt.NDArray[np.bool_] | None
    """True for samples that the fit did not use; None without a fit."""
    segments: tuple[LoggedSegment, ...]
    """Segments; `start` and `stop` are indices of these samples."""
    drive_unit: str
    """V or A."""


def make_recording(log: Log, series: ForceSeries | None) -> Recording:
    """Return the samples of a log, or those of its prediction.

    Args:
        log: log with its segments.
        series: recorded and simulated force of the same log, or None.

    Raises:
        ReportError: the samples lack a channel that the plots need.
    """
    samples = log.samples
    for name in _CHANNELS:
        if series is None and name not in samples:
            raise ReportError(
                f"{log.path}: the samples have no channel {name!r}; a report needs {', '.join(_CHANNELS)}"
            )
    source = samples if series is None else series.arrays
    time = np.asarray(source["time"], float)
    return Recording(
        time=time,
        displacement=np.asarray(source["displacement"], float),
        velocity=np.asarray(source["velocity"], float),
        drive=np.asarray(samples["coil_drive"] if series is None else series.arrays["drive"], float),
        force=np.asarray(source["force"], float),
        simulated=None if series is None else np.asarray(series.arrays["simulated"], float),
        held_out=None if series is None else np.asarray(series.arrays["held_out"], bool),
        segments=tuple(_rebase_segment(segment, samples["time"], time) for segment in log.segments),
        drive_unit=log.metadata["run"]["drive_unit"],
    )


def _rebase_segment(segment: LoggedSegment, logged: npt.NDArray[np.generic], time: Array) -> LoggedSegment:
    """Return the segment with sample indices of another time base."""
    last = max(segment.stop - 1, segment.start)
    first, final = (float(logged[min(i, len(logged) - 1)]) for i in (segment.start, last))
    start, stop = np.searchsorted(time, [first - 1e-6, final + 1e-6])
    fields = {name: getattr(segment, name) for name in segment.__dataclass_fields__}
    return LoggedSegment(**{**fields, "start": int(start), "stop": int(stop)})
