"""Reads a log into arrays."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt
import orjson
from mcap.reader import McapReader, make_reader

from bench.errors import LogError
from bench.recorder.columns import SECOND
from bench.recorder.mcap_file import DAMAGE, MAGIC, file_errors
from bench.recorder.messages import EVENT, PROFILE, REQUIRED_FIELDS, SAMPLE, SAMPLE_FIELDS, SEGMENT

Array = npt.NDArray[np.float64] | npt.NDArray[np.int64]


@dataclass(frozen=True)
class LoggedSegment:
    """One segment, with the samples that it covers."""

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
    """[V or A], none where the drive varies."""
    start: int
    """First sample."""
    stop: int
    """One beyond the last sample."""


@dataclass(frozen=True)
class Log:
    """Everything in a log, samples as arrays."""

    path: Path
    samples: dict[str, Array]
    """By field, each of shape (samples,), in the units of metadata `units`; beside them `time` [s] from the first
    sample and `time_ns`, the bench clock. NaN, or segment -1, where a sample has no such value."""
    segments: list[LoggedSegment]
    metadata: dict[str, dict[str, str]]
    """By record: run, units, calibration, clocks, channels, outcome."""
    events: list[dict[str, Any]] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)

    @property
    def outcome(self) -> str:
        """How the recording ended: clean, lossy, truncated or incomplete."""
        return self.metadata["outcome"]["outcome"]


def read_log(path: Path | str) -> Log:
    """Read a whole log.

    Args:
        path: a closed log; one that a kill has cut off needs ``mrbench salvage`` first.

    Raises:
        LogError: there is no such file, it is no log of ours, is cut off or damaged, or holds no sample.
    """
    path = Path(path)
    with file_errors(path), path.open("rb") as file:
        check_whole(path, file)
        try:
            return _read(path, make_reader(file, validate_crcs=True))
        except DAMAGE as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error


def check_whole(path: Path, file: IO[bytes]) -> None:
    """Check that a file is an MCAP file from its first byte to its last; leaves it at its start.

    Raises:
        LogError: it is none, or its end is missing.
    """
    if file.read(len(MAGIC)) != MAGIC:
        raise LogError(f"{path}: not an MCAP file; give a log that `mrbench run` or `mrbench import` wrote")
    size = file.seek(0, 2)
    file.seek(max(0, size - len(MAGIC)))
    if size < 2 * len(MAGIC) or file.read() != MAGIC:
        raise LogError(f"{path}: the log is truncated, its recorder was killed; run `mrbench salvage {path}`")
    file.seek(0)


def check_profile(path: Path, profile: str) -> None:
    """Check that an MCAP file is a log of ours.

    Raises:
        LogError: its profile is another.
    """
    if profile != PROFILE:
        raise LogError(
            f"{path}: an MCAP file of profile {profile or 'none'!r}, not {PROFILE!r}; it is no log of ours"
        )


def _read(path: Path, reader: McapReader) -> Log:
    check_profile(path, reader.get_header().profile)
    messages: dict[str, list[bytes]] = {SAMPLE: [], SEGMENT: [], EVENT: []}
    # In the order of the file, which is that of the samples: nothing has to be sorted.
    for _, channel, message in reader.iter_messages(topics=list(messages), log_time_order=False):
        messages[channel.topic].append(message.data)
    if not messages[SAMPLE]:
        raise LogError(f"{path}: the log holds no sample; its run ended before one came")
    samples = _arrays(_decoded(messages[SAMPLE]))
    return Log(
        path=path,
        samples=samples,
        segments=_segments(_decoded(messages[SEGMENT]), samples["time_ns"]),
        metadata={record.name: record.metadata for record in reader.iter_metadata()},
        events=_decoded(messages[EVENT]),
        attachments={document.name: document.data for document in reader.iter_attachments()},
    )


def _decoded(messages: list[bytes]) -> list[dict[str, Any]]:
    """The messages, parsed as one JSON array: twice as fast as one by one."""
    parsed: list[dict[str, Any]] = orjson.loads(b"[" + b",".join(messages) + b"]")
    return parsed


def _nanoseconds(messages: Iterable[dict[str, Any]]) -> list[int]:
    return [message["timestamp"]["sec"] * SECOND + message["timestamp"]["nsec"] for message in messages]


def _arrays(messages: list[dict[str, Any]]) -> dict[str, Array]:
    time_ns = np.array(_nanoseconds(messages), dtype=np.int64)
    arrays: dict[str, Array] = {"time_ns": time_ns, "time": (time_ns - time_ns[0]) / SECOND}
    present = {name for message in messages for name in message}
    for name in SAMPLE_FIELDS:
        if name == "segment" and name in present:
            arrays[name] = np.array([message.get(name, -1) for message in messages], dtype=np.int64)
        elif name in present:
            arrays[name] = _column(messages, name)
    return arrays


def _column(messages: list[dict[str, Any]], name: str) -> Array:
    if name in REQUIRED_FIELDS:
        return np.array([message[name] for message in messages], dtype=np.float64)
    return np.array([message.get(name, np.nan) for message in messages], dtype=np.float64)


def _segments(marks: list[dict[str, Any]], time_ns: Array) -> list[LoggedSegment]:
    """The segments; one whose end is missing reaches to the last sample."""
    times = dict(zip(((mark["index"], mark["phase"]) for mark in marks), _nanoseconds(marks), strict=True))
    segments = []
    for mark in sorted((mark for mark in marks if mark["phase"] == "start"), key=lambda mark: mark["index"]):
        first = times[mark["index"], "start"]
        last = times.get((mark["index"], "end"), time_ns[-1])
        given = {key: value for key, value in mark.items() if key not in ("timestamp", "phase")}
        start, stop = np.searchsorted(time_ns, first), np.searchsorted(time_ns, last, side="right")
        segments.append(LoggedSegment(**given, start=int(start), stop=int(stop)))
    return segments
