"""What a report draws: a recording on one time base, with the simulated force beside it where a fit was given."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.errors import ReportError
from bench.recorder.reader import Log, LoggedSegment
from bench.report.series import Series

Array = npt.NDArray[np.float64]

_SHOWN = ("displacement", "velocity", "force", "coil_drive")
"""Channels that a picture needs."""


@dataclass(frozen=True)
class Recording:
    """Samples of one log, arrays (N,)."""

    time: Array
    """[s] on the log's clock."""
    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    drive: Array
    """[V or A]"""
    force: Array
    """[N] recorded."""
    simulated: Array | None
    """[N] none without a fit."""
    held_out: npt.NDArray[np.bool_] | None
    """True where the fit did not see the sample; none without a fit."""
    segments: tuple[LoggedSegment, ...]
    """`start` and `stop` count these samples."""
    drive_unit: str
    """V or A."""


def recording_from(log: Log, series: Series | None) -> Recording:
    """The samples of a log, or those of its prediction.

    Args:
        log: as recorded; its segments tell what to draw.
        series: recorded and simulated force of the same log, or none.

    Raises:
        ReportError: the samples lack a channel that the pictures show.
    """
    samples = log.samples
    for name in _SHOWN:
        if series is None and name not in samples:
            raise ReportError(
                f"{log.path}: no channel {name!r} in the samples; a report shows {', '.join(_SHOWN)}"
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
        segments=tuple(_onto(segment, samples["time"], time) for segment in log.segments),
        drive_unit=log.metadata["run"]["drive_unit"],
    )


def _onto(segment: LoggedSegment, logged: npt.NDArray[np.generic], time: Array) -> LoggedSegment:
    """A segment whose samples are counted on another time base."""
    last = max(segment.stop - 1, segment.start)
    first, final = (float(logged[min(i, len(logged) - 1)]) for i in (segment.start, last))
    start, stop = np.searchsorted(time, [first - 1e-6, final + 1e-6])
    fields = {name: getattr(segment, name) for name in segment.__dataclass_fields__}
    return LoggedSegment(**{**fields, "start": int(start), "stop": int(stop)})
