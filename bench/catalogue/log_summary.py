"""Summary of a log, read without its samples: fast for a log of any length, complete or truncated."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO, cast, get_args

import orjson
from mcap.reader import make_reader
from mcap.records import Header, Message, Metadata
from mcap.stream_reader import StreamReader

from bench.catalogue.models import RunOutcome
from bench.endings import RunEnding, read_ending
from bench.errors import LogError
from bench.log import (
    DAMAGE_ERRORS,
    MAGIC,
    NS_PER_SECOND,
    SAMPLE,
    check_profile,
    convert_file_errors,
    is_closed,
    utc_at,
)


@dataclass(frozen=True)
class LogSummary:
    """Description of a run in its log."""

    id: str
    method: str
    method_sha256: str
    """Hash of the content of the method; empty in logs of older versions and in imports."""
    specimen: str
    operator: str
    source: str
    started: datetime | None
    """UTC of the first sample; None if the log does not contain it."""
    duration_s: float | None
    """Time [s] from the first to the last sample; None for a truncated log."""
    outcome: RunOutcome | None
    """None for a truncated log: its recorder is still writing or was killed."""
    reason: str
    continues: str
    """Id of the run that it continues; empty without one."""
    ending: RunEnding | None
    """None if the log neither contains nor determines it."""
    lost: dict[str, int]
    """Number of lost samples by channel; empty for a truncated log."""
    calibration: Mapping[str, str]
    """Calibration by channel: JSON of its certificate, or text."""
    checks: Mapping[str, str]
    """Latest check by channel, as JSON; empty in logs of older versions."""


def read_log_summary(path: Path) -> LogSummary:
    """Read the summary of a log.

    Raises:
        LogError: the file does not exist or is not an mrbench log.
    """
    with convert_file_errors(path), path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError(f"{path}: not an MCAP file")
        try:
            return _read_closed(path, file) if is_closed(file) else _read_truncated(path, file)
        except DAMAGE_ERRORS as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error


def compute_sha256(path: Path) -> str:
    """Compute the SHA-256 of a file's content, in hexadecimal.

    Raises:
        LogError: the file cannot be read.
    """
    with convert_file_errors(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_complete(path: Path) -> bool:
    """Return whether a file has the end that the recorder writes when it closes a log.

    Raises:
        LogError: the file cannot be read.
    """
    with convert_file_errors(path), path.open("rb") as file:
        return is_closed(file)


def _read_closed(path: Path, file: IO[bytes]) -> LogSummary:
    reader = make_reader(file)
    check_profile(path, reader.get_header().profile)
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    summary = reader.get_summary()
    if summary is None or summary.statistics is None:
        raise LogError(f"{path}: the log has no index; run `mrbench salvage {path}`")
    counts = summary.statistics.channel_message_counts
    if not any(counts.get(number) for number, channel in summary.channels.items() if channel.topic == SAMPLE):
        return _make_summary(path, metadata, None, None)
    first, last = summary.statistics.message_start_time, summary.statistics.message_end_time
    return _make_summary(path, metadata, first, last)


def _read_truncated(path: Path, file: IO[bytes]) -> LogSummary:
    """Read the records before the first message; the recorder describes the run there."""
    metadata: dict[str, dict[str, str]] = {}
    try:
        for record in StreamReader(file).records:
            if isinstance(record, Header):
                check_profile(path, record.profile)
            elif isinstance(record, Metadata):
                metadata[record.name] = record.metadata
            elif isinstance(record, Message):
                return _make_summary(path, metadata, record.log_time, None)
    except DAMAGE_ERRORS:  # truncated before its first message; the description may still be complete
        pass
    return _make_summary(path, metadata, None, None)


def _make_summary(
    path: Path, metadata: Mapping[str, Mapping[str, str]], first_ns: int | None, last_ns: int | None
) -> LogSummary:
    run, end = metadata.get("run"), metadata.get("outcome", {})
    if run is None:
        raise LogError(f"{path}: the log has no metadata record `run`, so it cannot be catalogued")
    outcome = end.get("outcome")
    return LogSummary(
        # An import is named after its CSV files, which can be imported twice; the log's file name is unique.
        id=path.stem if run.get("source") == "import" else run["id"],
        method=run.get("method", ""),
        method_sha256=run.get("method_sha256", ""),
        specimen=run.get("specimen", ""),
        operator=run.get("operator", ""),
        source=run.get("source", "run"),
        started=utc_at(run.get("utc_offset", ""), first_ns or 0),
        duration_s=None if first_ns is None or last_ns is None else (last_ns - first_ns) / NS_PER_SECOND,
        outcome=cast(RunOutcome, outcome) if outcome in get_args(RunOutcome) else None,
        reason=end.get("reason", ""),
        continues=run.get("continues", ""),
        ending=read_ending(end),
        lost=_read_losses(end.get("lost", "")),
        calibration=metadata.get("calibration", {}),
        checks=metadata.get("checks", {}),
    )


def _read_losses(text: str) -> dict[str, int]:
    """Return the losses in the metadata of a log; none where an older version did not record them."""
    try:
        losses = orjson.loads(text or "{}")
    except orjson.JSONDecodeError:
        return {}
    return {str(channel): int(count) for channel, count in losses.items()} if isinstance(losses, dict) else {}
