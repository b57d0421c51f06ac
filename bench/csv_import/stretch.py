"""Writing of one stretch to a log: its samples, with segment marks between them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.log import LogWriter, Phase


@dataclass(frozen=True)
class ImportedSegment:
    """Detected segment of a stretch, with its name in the log."""

    start: int
    """First sample."""
    stop: int
    """One after the last sample."""
    name: str
    motion: str
    drive: str
    amplitude: float | None = None
    """[m]"""
    frequency: float | None = None
    """[Hz]"""
    drive_value: float | None = None
    """[V or A]; None if the drive varies."""


def write_stretch(
    writer: LogWriter,
    stretch: str,
    time_ns: npt.NDArray[np.int64],
    values: Mapping[str, npt.ArrayLike],
    segments: Sequence[ImportedSegment],
    first_index: int = 0,
) -> int:
    """Write the samples and segment marks of a stretch in order of time.

    Args:
        writer: writer of an open log.
        stretch: name of the stretch.
        time_ns: bench clock [ns], increasing, shape (samples,).
        values: values by field of a sample, each of shape (samples,), without the field `segment`.
        segments: segments in order, without overlap; samples between them belong to none.
        first_index: index of the first segment.

    Returns:
        The index after that of the last segment.
    """
    columns = {name: np.asarray(column) for name, column in values.items()}
    written = 0
    for index, segment in enumerate(segments, first_index):
        _write_samples(writer, time_ns, columns, written, segment.start, -1)
        _write_mark(writer, "start", int(time_ns[segment.start]), stretch, index, segment)
        _write_samples(writer, time_ns, columns, segment.start, segment.stop, index)
        _write_mark(writer, "end", int(time_ns[segment.stop - 1]), stretch, index, segment)
        written = segment.stop
    _write_samples(writer, time_ns, columns, written, len(time_ns), -1)
    return first_index + len(segments)


def _write_samples(
    writer: LogWriter,
    time_ns: npt.NDArray[np.int64],
    columns: Mapping[str, npt.NDArray[np.generic]],
    start: int,
    stop: int,
    index: int,
) -> None:
    if stop > start:
        part = slice(start, stop)
        values: dict[str, npt.ArrayLike] = {name: column[part] for name, column in columns.items()}
        writer.write_samples(time_ns[part], {**values, "segment": np.full(stop - start, index)})


def _write_mark(
    writer: LogWriter, phase: Phase, time_ns: int, stretch: str, index: int, segment: ImportedSegment
) -> None:
    writer.write_segment(
        time_ns,
        phase=phase,
        index=index,
        name=segment.name,
        stretch=stretch,
        motion=segment.motion,
        drive=segment.drive,
        amplitude=segment.amplitude,
        frequency=segment.frequency,
        drive_value=segment.drive_value,
    )
