"""Import of CSV files into one log, one after the other on one clock."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from bench.csv_import.csv_file import DRIVE_KINDS, CsvRecording, read_csv
from bench.csv_import.segmentation import find_segments, make_segment_names
from bench.csv_import.stretch import ImportedSegment, write_stretch
from bench.csv_import.units import make_conversions
from bench.errors import RecordingError
from bench.log import NS_PER_SECOND, ChannelInfo, LogWriter, RunHeader, smooth_velocity, write_atomically

_LONGEST_TRAVEL = 2.0
"""Travel above which the displacement was probably recorded in another unit [m]."""
FILE_GAP_NS = NS_PER_SECOND
"""Time [ns] from the last sample of a file to the first of the next."""


def import_recordings(
    files: Sequence[Path],
    out: Path,
    headers: Mapping[str, str] | None = None,
    drive_kind: str | None = None,
    specimen: str = "unknown",
    units: Mapping[str, str] | None = None,
    reversed_columns: Collection[str] = (),
) -> str:
    """Write a log from files, or no log if one of them is refused.

    Args:
        files: CSV files; each becomes a stretch with the file's name, and their rates may differ.
        out: log to write.
        headers: header in the files by column name, where they differ.
        drive_kind: one of `csv_file.DRIVE_KINDS`; by default ``driver_command_v`` or ``coil_a``, by unit.
        specimen: damper under test, with its serial number.
        units: unit in the files by column name, where it differs.
        reversed_columns: names of columns that are recorded in the opposite sense.

    Returns:
        Summary of the log as text.

    Raises:
        RecordingError: a file or a unit is refused, or the units of the drives differ.
        LogError: the log cannot be written.
    """
    conversions = make_conversions(units or {}, reversed_columns)
    recordings = [read_csv(path, headers, drive_kind, conversions) for path in files]
    unit = _check_drive_unit(recordings, files, drive_kind)
    use_velocity = all(recording.velocity is not None for recording in recordings)
    header = _make_header(recordings, unit, drive_kind, specimen, use_velocity)
    with write_atomically(out) as partial, LogWriter(partial, header) as writer:
        start = index = 0
        for name, recording in zip(_make_stretch_names(recordings), recordings, strict=True):
            time_ns = start + recording.time_ns
            index = write_stretch(
                writer, name, time_ns, _make_columns(recording, use_velocity), _make_segments(recording), index
            )
            start = int(time_ns[-1]) + FILE_GAP_NS
    samples = sum(len(recording.time_ns) for recording in recordings)
    stretches = "one stretch" if len(recordings) == 1 else f"{len(recordings)} stretches"
    text = f"{samples} samples in {stretches} and {index} segments"
    return "; ".join([text, *_collect_notes(recordings, use_velocity)])


def _collect_notes(recordings: Sequence[CsvRecording], use_velocity: bool) -> list[str]:
    """Return notes on velocity, time stamps and travel."""
    notes = []
    if not use_velocity and any(recording.velocity is not None for recording in recordings):
        notes.append("velocity computed from displacement, as not every file has velocity_mps")
    for recording in recordings:
        if recording.note:
            notes.append(f"{recording.name}: {recording.note}")
        steps = np.diff(recording.time_ns) / NS_PER_SECOND
        if np.max(steps) > 1.5 * np.median(steps):
            notes.append(f"{recording.name}: time steps from {np.min(steps):.3g} to {np.max(steps):.3g} s")
        travel = float(np.ptp(recording.displacement))
        if travel > _LONGEST_TRAVEL:
            advice = "if these are mm, import with --unit displacement_m=mm"
            notes.append(f"{recording.name}: the travel is {travel:.3g} m; {advice}")
    return notes


def _check_drive_unit(
    recordings: Sequence[CsvRecording], files: Sequence[Path], drive_kind: str | None
) -> Literal["V", "A"]:
    """Return the common drive unit of all files."""
    unit = recordings[0].drive_unit
    for path, recording in zip(files, recordings, strict=True):
        if recording.drive_unit != unit:
            raise RecordingError(
                f"{path.name}, row 1: the drive is in {recording.drive_unit}, in {files[0].name} in {unit};"
                " import files with voltage and files with current into separate logs"
            )
    if drive_kind is not None and DRIVE_KINDS[drive_kind] != unit:
        raise RecordingError(
            f"{files[0].name}, row 1: the drive is in {unit}, but {drive_kind} is in {DRIVE_KINDS[drive_kind]};"
            " give a --drive-kind with the file's unit"
        )
    return unit


def _make_header(
    recordings: Sequence[CsvRecording],
    unit: Literal["V", "A"],
    drive_kind: str | None,
    specimen: str,
    use_velocity: bool,
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
        velocity_from="measured" if use_velocity else "smoothed displacement",
        clocks={"bench": "time since the first sample of each file; one second between files"},
        channels={name: ChannelInfo(unit=channel, rate_hz=rate) for name, channel in units.items()},
    )


def _make_stretch_names(recordings: Sequence[CsvRecording]) -> list[str]:
    """Return the file names; repeated names, of files in different folders, get ``_2``, ``_3``."""
    counts: Counter[str] = Counter()
    names = []
    for recording in recordings:
        counts[recording.name] += 1
        count = counts[recording.name]
        names.append(recording.name if count == 1 else f"{recording.name}_{count}")
    return names


def _make_columns(recording: CsvRecording, use_velocity: bool) -> dict[str, npt.ArrayLike]:
    velocity = recording.velocity
    if velocity is None or not use_velocity:
        velocity = smooth_velocity(recording.displacement, recording.rate)
    values: dict[str, npt.ArrayLike] = {
        "displacement": recording.displacement,
        "velocity": velocity,
        "force": recording.force,
        "coil_drive": recording.drive,
    }
    return values if recording.temperature is None else {**values, "temperature": recording.temperature}


def _make_segments(recording: CsvRecording) -> list[ImportedSegment]:
    time = recording.time_ns / NS_PER_SECOND
    segments = find_segments(np.asarray(time), recording.displacement, recording.drive, recording.rate)
    return [
        ImportedSegment(
            start=segment.start,
            stop=segment.stop,
            name=name,
            motion=segment.motion,
            drive="varying" if segment.drive_value is None else "constant",
            amplitude=segment.amplitude,
            frequency=segment.frequency,
            drive_value=segment.drive_value,
        )
        for segment, name in zip(segments, make_segment_names(segments, recording.drive_unit), strict=True)
    ]
