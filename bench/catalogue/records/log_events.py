"""Events of a log, read without its samples."""

from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import orjson
from mcap.reader import McapReader, make_reader

from bench.errors import LogError
from bench.log import DAMAGE_ERRORS, EVENT, NS_PER_SECOND, check_complete, convert_file_errors, utc_at


class LogEvent(NamedTuple):
    """One event in a log."""

    at: datetime
    """UTC; counted from the time of the file if the log does not contain its start."""
    time_s: float
    """Time since the first message of the log [s]."""
    kind: str
    text: str


def read_log_events(path: Path) -> list[LogEvent]:
    """Read the events of a complete log, in order.

    Raises:
        LogError: the file cannot be read, is not an MCAP file, or is truncated or damaged.
    """
    with convert_file_errors(path), path.open("rb") as file:
        check_complete(path, file)
        try:
            return _read(path, make_reader(file))
        except DAMAGE_ERRORS as error:
            raise LogError(f"{path}: the log is damaged ({error}); run `mrbench salvage {path}`") from error


def _read(path: Path, reader: McapReader) -> list[LogEvent]:
    run = next((record.metadata for record in reader.iter_metadata() if record.name == "run"), {})
    summary = reader.get_summary()
    first_ns = summary.statistics.message_start_time if summary and summary.statistics else 0
    offset = run.get("utc_offset", "")
    # The zero of an unknown clock is set so that the log begins at the time of its file.
    fallback = path.stat().st_mtime - first_ns / NS_PER_SECOND
    events = []
    for _, _, message in reader.iter_messages([EVENT]):
        content, time_ns = orjson.loads(message.data), message.log_time
        at = utc_at(offset, time_ns) or datetime.fromtimestamp(fallback + time_ns / NS_PER_SECOND, UTC)
        events.append(LogEvent(at, (time_ns - first_ns) / NS_PER_SECOND, content["kind"], content["text"]))
    return events
