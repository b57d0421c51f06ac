"""Writes one continuous recording into a log: its samples, with each segment's start and end in their place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bench.recorder.messages import Phase
from bench.recorder.writer import LogWriter


@dataclass(frozen=True)
class Span:
    """One segment of a stretch, as it is to stand in the log."""

    start: int
    """First sample."""
    stop: int
    """One beyond the last sample."""
    name: str
    motion: str
    drive: str
    amplitude: float | None = None
    """[m]"""
    frequency: float | None = None
    """[Hz]"""
    drive_value: float | None = None
    """[V or A], none where the drive varies."""


def write_stretch(
    writer: LogWriter,
    stretch: str,
    time_ns: npt.NDArray[np.int64],
    values: Mapping[str, npt.ArrayLike],
    spans: Sequence[Span],
    first_index: int = 0,
) -> int:
    """Write a stretch in the order of its time.

    Args:
        writer: an open log.
        stretch: its name.
        time_ns: bench clock [ns], increasing, shape (samples,).
        values: by field of a sample, each of shape (samples,); the segment is added.
        spans: its segments in order, not overlapping; samples between them belong to none.
        first_index: index of the first segment.

    Returns:
        The index after the last segment's.
    """
    columns = {name: np.asarray(column) for name, column in values.items()}
    done = 0
    for index, span in enumerate(spans, first_index):
        _write(writer, time_ns, columns, done, span.start, -1)
        _mark(writer, "start", int(time_ns[span.start]), stretch, index, span)
        _write(writer, time_ns, columns, span.start, span.stop, index)
        _mark(writer, "end", int(time_ns[span.stop - 1]), stretch, index, span)
        done = span.stop
    _write(writer, time_ns, columns, done, len(time_ns), -1)
    return first_index + len(spans)


def _write(
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
        writer.samples(time_ns[part], {**values, "segment": np.full(stop - start, index)})


def _mark(writer: LogWriter, phase: Phase, time_ns: int, stretch: str, index: int, span: Span) -> None:
    writer.segment(
        time_ns,
        phase=phase,
        index=index,
        name=span.name,
        stretch=stretch,
        motion=span.motion,
        drive=span.drive,
        amplitude=span.amplitude,
        frequency=span.frequency,
        drive_value=span.drive_value,
    )
