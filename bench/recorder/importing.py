"""Puts recordings made elsewhere into one log, one after the other on one clock."""

from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from bench.errors import RecordingError
from bench.recorder.columns import SECOND
from bench.recorder.csv_file import DRIVE_KINDS, CsvRecording, read_csv
from bench.recorder.header import Channel, RunHeader
from bench.recorder.replacement import replacing
from bench.recorder.segments import find_segments, segment_names
from bench.recorder.stretch import Span, write_stretch
from bench.recorder.velocity import smooth_velocity
from bench.recorder.writer import LogWriter

PAUSE = SECOND
"""[ns] from the last sample of a file to the first of the next."""


def import_recordings(
    files: Sequence[Path],
    out: Path,
    headers: Mapping[str, str] | None = None,
    drive_kind: str | None = None,
    specimen: str = "unknown",
) -> str:
    """Write a log from files; nothing is left of it if any of them is refused.

    Args:
        files: CSV, each a stretch of its own under its own name; their rates may differ.
        out: the log.
        headers: the files' own header by our column's name, where they differ.
        drive_kind: one of `csv_file.DRIVE_KINDS`; by default ``driver_command_v`` or ``coil_a``, by unit.
        specimen: the damper, with its serial number.

    Returns:
        What was written, in words.

    Raises:
        RecordingError: a file is refused, or the files do not go together.
        LogError: the log cannot be written.
    """
    recordings = [read_csv(path, headers, drive_kind) for path in files]
    unit = _drive_unit(recordings, files, drive_kind)
    measured = all(recording.velocity is not None for recording in recordings)
    header = _header(recordings, unit, drive_kind, specimen, measured)
    with replacing(out) as beside, LogWriter(beside, header) as writer:
        start = index = 0  # one clock for all files: each begins a pause after the one before
        for name, recording in zip(_stretch_names(recordings), recordings, strict=True):
            time_ns = start + recording.time_ns
            index = write_stretch(writer, name, time_ns, _values(recording, measured), _spans(recording), index)
            start = int(time_ns[-1]) + PAUSE
    samples = sum(len(recording.time_ns) for recording in recordings)
    stretches = "one stretch" if len(recordings) == 1 else f"{len(recordings)} stretches"
    text = f"{samples} samples in {stretches} and {index} segments"
    return "; ".join([text, *_notes(recordings, measured)])


def _notes(recordings: Sequence[CsvRecording], measured: bool) -> list[str]:
    """What the one who imports should know."""
    notes = []
    if not measured and any(recording.velocity is not None for recording in recordings):
        notes.append("velocity made from displacement, as not every file has velocity_mps")
    for recording in recordings:
        steps = np.diff(recording.time_ns) / SECOND
        if np.max(steps) > 1.5 * np.median(steps):
            notes.append(f"{recording.name}: steps of time from {np.min(steps):.3g} to {np.max(steps):.3g} s")
    return notes


def _drive_unit(
    recordings: Sequence[CsvRecording], files: Sequence[Path], drive_kind: str | None
) -> Literal["V", "A"]:
    """The one unit of every file's drive."""
    unit = recordings[0].drive_unit
    for path, recording in zip(files, recordings, strict=True):
        if recording.drive_unit != unit:
            raise RecordingError(
                f"{path.name}, row 1: driven in {recording.drive_unit}, {files[0].name} in {unit};"
                " import voltage and current into logs of their own"
            )
    if drive_kind is not None and DRIVE_KINDS[drive_kind] != unit:
        raise RecordingError(
            f"{files[0].name}, row 1: driven in {unit}, but {drive_kind} is in {DRIVE_KINDS[drive_kind]};"
            " give a --drive-kind of the file's unit"
        )
    return unit


def _header(
    recordings: Sequence[CsvRecording],
    unit: Literal["V", "A"],
    drive_kind: str | None,
    specimen: str,
    measured: bool,
) -> RunHeader:
    names = [recording.name for recording in recordings]
    rate = max(recording.rate for recording in recordings)
    units = {"displacement": "m", "force": "N", "coil_drive": unit}
    return RunHeader(
        id=names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more",
        specimen=specimen,
        method=", ".join(names),
        drive_kind=drive_kind or ("driver_command_v" if unit == "V" else "coil_a"),
        drive_unit=unit,
        source="import",
        versions={"mrbench": version("mrbench")},
        velocity_from="measured" if measured else "smoothed displacement",
        clocks={"bench": "each file from its own first sample, one second from file to file"},
        channels={name: Channel(unit=channel, rate_hz=rate) for name, channel in units.items()},
    )


def _stretch_names(recordings: Sequence[CsvRecording]) -> list[str]:
    """The files' names; of files from different folders with one name the later get ``_2``, ``_3``."""
    seen: Counter[str] = Counter()
    names = []
    for recording in recordings:
        seen[recording.name] += 1
        count = seen[recording.name]
        names.append(recording.name if count == 1 else f"{recording.name}_{count}")
    return names


def _values(recording: CsvRecording, measured: bool) -> dict[str, npt.ArrayLike]:
    velocity = recording.velocity
    if velocity is None or not measured:
        velocity = smooth_velocity(recording.displacement, recording.rate)
    values: dict[str, npt.ArrayLike] = {
        "displacement": recording.displacement,
        "velocity": velocity,
        "force": recording.force,
        "coil_drive": recording.drive,
    }
    return values if recording.temperature is None else {**values, "temperature": recording.temperature}


def _spans(recording: CsvRecording) -> list[Span]:
    time = recording.time_ns / SECOND
    found = find_segments(np.asarray(time), recording.displacement, recording.drive, recording.rate)
    return [
        Span(
            start=segment.start,
            stop=segment.stop,
            name=name,
            motion=segment.motion,
            drive="varying" if segment.drive_value is None else "constant",
            amplitude=segment.amplitude,
            frequency=segment.frequency,
            drive_value=segment.drive_value,
        )
        for segment, name in zip(found, segment_names(found, recording.drive_unit), strict=True)
    ]
