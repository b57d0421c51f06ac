"""What a log says of itself, read without its samples: quick for a log of any length, whole or cut off."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import IO, cast, get_args

from mcap.reader import make_reader
from mcap.records import Header, Message, Metadata
from mcap.stream_reader import StreamReader

from bench.catalogue.models import RunOutcome
from bench.errors import LogError
from bench.recorder.columns import SECOND
from bench.recorder.mcap_file import DAMAGE, MAGIC, file_errors
from bench.recorder.messages import SAMPLE
from bench.recorder.reader import check_profile


@dataclass(frozen=True)
class LogFacts:
    """A run, as its log tells it."""

    id: str
    method: str
    specimen: str
    operator: str
    source: str
    started: datetime | None
    """UTC of the first sample; none where the log does not say."""
    duration_s: float | None
    """[s] from first to last sample; none where the log is cut off."""
    outcome: RunOutcome | None
    """None where the log is cut off: its recorder writes still, or was killed."""
    reason: str


def read_facts(path: Path) -> LogFacts:
    """What a log says of itself.

    Raises:
        LogError: there is no such file, or it is no log of ours.
    """
    with file_errors(path), path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError(f"{path}: not an MCAP file")
        try:
            return _of_whole(path, file) if _is_whole(file) else _of_cut_off(path, file)
        except DAMAGE as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal.

    Raises:
        LogError: it cannot be read.
    """
    with file_errors(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def has_end(path: Path) -> bool:
    """Whether a file ends as a log does that its recorder has closed.

    Raises:
        LogError: it cannot be read.
    """
    with file_errors(path), path.open("rb") as file:
        return _is_whole(file)


def _is_whole(file: IO[bytes]) -> bool:
    size = file.seek(0, 2)
    file.seek(max(0, size - len(MAGIC)))
    whole = size >= 2 * len(MAGIC) and file.read() == MAGIC
    file.seek(0)
    return whole


def _of_whole(path: Path, file: IO[bytes]) -> LogFacts:
    reader = make_reader(file)
    check_profile(path, reader.get_header().profile)
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    summary = reader.get_summary()
    if summary is None or summary.statistics is None:
        raise LogError(f"{path}: the log has no index; run `mrbench salvage {path}`")
    counts = summary.statistics.channel_message_counts
    if not any(counts.get(number) for number, channel in summary.channels.items() if channel.topic == SAMPLE):
        return _facts(path, metadata, None, None)
    first, last = summary.statistics.message_start_time, summary.statistics.message_end_time
    return _facts(path, metadata, first, last)


def _of_cut_off(path: Path, file: IO[bytes]) -> LogFacts:
    """What stands before the first message; there the recorder writes whose run it is."""
    metadata: dict[str, dict[str, str]] = {}
    try:
        for record in StreamReader(file).records:
            if isinstance(record, Header):
                check_profile(path, record.profile)
            elif isinstance(record, Metadata):
                metadata[record.name] = record.metadata
            elif isinstance(record, Message):
                return _facts(path, metadata, record.log_time, None)
    except DAMAGE:  # cut off before its first message: whose it is may stand in it all the same
        pass
    return _facts(path, metadata, None, None)


def _facts(
    path: Path, metadata: Mapping[str, Mapping[str, str]], first_ns: int | None, last_ns: int | None
) -> LogFacts:
    run, end = metadata.get("run"), metadata.get("outcome", {})
    if run is None:
        raise LogError(f"{path}: the log does not say whose run it is")
    said = end.get("outcome")
    imported = run.get("source") == "import"
    return LogFacts(
        # Names of imported files come again; the log's own does not.
        id=path.stem if imported else run["id"],
        method=run.get("method", ""),
        specimen=run.get("specimen", ""),
        operator=run.get("operator", ""),
        source=run.get("source", "run"),
        started=_started(run.get("utc_offset", ""), first_ns or 0),
        duration_s=None if first_ns is None or last_ns is None else (last_ns - first_ns) / SECOND,
        outcome=cast(RunOutcome, said) if said in get_args(RunOutcome) else None,
        reason=end.get("reason", ""),
    )


def _started(utc_offset: str, first_ns: int) -> datetime | None:
    """UTC of the first sample, from UTC at zero of the bench clock; none where that is no time."""
    try:
        zero = datetime.fromisoformat(utc_offset)
    except ValueError:
        return None
    aware = zero if zero.tzinfo else zero.replace(tzinfo=UTC)
    return (aware + timedelta(microseconds=first_ns / 1e3)).astimezone(UTC)
