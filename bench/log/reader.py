"""Reader of a log into arrays."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt
import orjson
from mcap.reader import make_reader

from bench.errors import LogError
from bench.log.chunks import read_chunks
from bench.log.mcap_file import DAMAGE_ERRORS, MAGIC, convert_file_errors, is_closed
from bench.log.messages import (
    EVENT,
    NS_PER_SECOND,
    PROFILE,
    REQUIRED_FIELDS,
    SAMPLE,
    SAMPLE_FIELDS,
    SEGMENT,
    parse_timestamp,
)

Array = npt.NDArray[np.float64] | npt.NDArray[np.int64]


@dataclass(frozen=True)
class LoggedSegment:
    """One segment and its samples."""

    index: int
    name: str
    stretch: str
    motion: str
    drive: str
    amplitude: float | None
    """[m]"""
    frequency: float | None
    """[Hz]"""
    drive_value: float | None
    """[V or A]; None if the drive varies."""
    start: int
    """First sample."""
    stop: int
    """One after the last sample."""
    shunt: bool = False
    """True if the shunt of the load cell adds to the force."""


@dataclass(frozen=True)
class Log:
    """Content of a log, with samples as arrays."""

    path: Path
    samples: dict[str, Array]
    """Values by field, each of shape (samples,), in the units of metadata `units`. Also `time` [s] since the first
    sample, and `time_ns`, the bench clock [ns]. A missing value is NaN, a missing segment is -1."""
    segments: list[LoggedSegment]
    metadata: dict[str, dict[str, str]]
    """Metadata by record: run, units, calibration, clocks, channels, outcome."""
    events: list[dict[str, Any]] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)

    @property
    def outcome(self) -> str:
        """End of the recording: clean, lossy, truncated or incomplete."""
        return self.metadata["outcome"]["outcome"]


def read_log(path: Path | str) -> Log:
    """Read a log.

    Args:
        path: complete log; repair a truncated one with ``mrbench salvage`` first.

    Raises:
        LogError: the file does not exist, is not an mrbench log, is truncated or damaged, or contains no sample.
    """
    path = Path(path)
    with convert_file_errors(path), path.open("rb") as file:
        check_complete(path, file)
        try:
            return _read(path, file)
        except DAMAGE_ERRORS as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error


def check_complete(path: Path, file: IO[bytes]) -> None:
    """Check that a file is an MCAP file with its end, and rewind it.

    Raises:
        LogError: it is another kind of file, or its end is missing.
    """
    if file.read(len(MAGIC)) != MAGIC:
        raise LogError(f"{path}: not an MCAP file; give a log that `mrbench run` or `mrbench import` wrote")
    if not is_closed(file):
        raise LogError(f"{path}: the log is truncated, its recorder was killed; run `mrbench salvage {path}`")


def check_profile(path: Path, profile: str) -> None:
    """Check that an MCAP file is an mrbench log.

    Raises:
        LogError: it has another profile.
    """
    if profile != PROFILE:
        raise LogError(
            f"{path}: not an mrbench log; it is an MCAP file of profile {profile or 'none'!r}, not {PROFILE!r}"
        )


def _read(path: Path, file: IO[bytes]) -> Log:
    reader = make_reader(file, validate_crcs=True)
    check_profile(path, reader.get_header().profile)
    file.seek(0)
    blocks: list[dict[str, Array]] = []
    marks: list[dict[str, Any]] = []
    events: list[dict[str, Any]] = []
    # The order of the file is that of the samples, so that nothing has to be sorted.
    for messages in read_chunks(file, (SAMPLE, SEGMENT, EVENT)):
        # Chunk by chunk: the parsed messages of a long log need ten times the memory of its columns.
        if bodies := messages.get(SAMPLE):
            blocks.append(_make_columns(_parse_messages(bodies)))
        marks += _parse_messages(messages.get(SEGMENT, []))
        events += _parse_messages(messages.get(EVENT, []))
    if not blocks:
        raise LogError(f"{path}: the log contains no sample; its run ended before the first one")
    samples = _join_columns(blocks)
    return Log(
        path=path,
        samples=samples,
        segments=_make_segments(marks, samples["time_ns"]),
        metadata={record.name: record.metadata for record in reader.iter_metadata()},
        events=events,
        attachments={attachment.name: attachment.data for attachment in reader.iter_attachments()},
    )


def _parse_messages(messages: list[bytes]) -> list[dict[str, Any]]:
    """Parse messages as one JSON array, which is twice as fast as one by one."""
    parsed: list[dict[str, Any]] = orjson.loads(b"[" + b",".join(messages) + b"]")
    return parsed


def _make_columns(messages: list[dict[str, Any]]) -> dict[str, Array]:
    """Return `time_ns` and one column for each field of some samples."""
    columns: dict[str, Array] = {"time_ns": np.array([parse_timestamp(m) for m in messages], dtype=np.int64)}
    present = {name for message in messages for name in message}
    for name in SAMPLE_FIELDS:
        if name in REQUIRED_FIELDS:
            columns[name] = np.array([message[name] for message in messages], dtype=np.float64)
        elif name in present:
            kind, missing = _describe_column(name)
            columns[name] = np.array([message.get(name, missing) for message in messages], dtype=kind)
    return columns


def _describe_column(name: str) -> tuple[np.dtype[Any], float]:
    """Return the type of an optional field's column, and the value of a sample that lacks the field."""
    return (np.dtype(np.int64), -1) if name == "segment" else (np.dtype(np.float64), np.nan)


def _join_columns(blocks: list[dict[str, Array]]) -> dict[str, Array]:
    """Return `time_ns`, `time` and one column for each field that any sample has."""
    time_ns = np.concatenate([block["time_ns"] for block in blocks])
    samples: dict[str, Array] = {"time_ns": time_ns, "time": (time_ns - time_ns[0]) / NS_PER_SECOND}
    for name in (name for name in SAMPLE_FIELDS if any(name in block for block in blocks)):
        kind, missing = _describe_column(name)
        parts = [block.get(name, np.full(len(block["time_ns"]), missing, kind)) for block in blocks]
        samples[name] = np.concatenate(parts).astype(kind, copy=False)
    return samples


def _make_segments(marks: list[dict[str, Any]], time_ns: Array) -> list[LoggedSegment]:
    """Make the segments; one without an end mark extends to the last sample."""
    times = {(mark["index"], mark["phase"]): parse_timestamp(mark) for mark in marks}
    segments = []
    for mark in sorted((mark for mark in marks if mark["phase"] == "start"), key=lambda mark: mark["index"]):
        first = times[mark["index"], "start"]
        last = times.get((mark["index"], "end"), time_ns[-1])
        fields = {key: value for key, value in mark.items() if key not in ("timestamp", "phase")}
        start, stop = np.searchsorted(time_ns, first), np.searchsorted(time_ns, last, side="right")
        segments.append(LoggedSegment(**fields, start=int(start), stop=int(stop)))
    return segments
