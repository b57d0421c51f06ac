"""Writer of MCAP files whose chunks are closed by time, so that a kill loses only a fraction of a second.

A chunk is closed after 0.2 s of bench or wall time, whichever comes first, or when it is large. A closed chunk is
passed to the operating system at once and synced to the disk four times a second.
"""

import os
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO

import orjson
from mcap.writer import Writer

from bench.log.mcap_file import finish, flush, start_writer
from bench.log.messages import NS_PER_SECOND, make_message_schema, make_schema_name

CHUNK_TIME = 0.2
"""Bench or wall time [s] after which a chunk is closed."""

SYNC_PERIOD = 0.25
"""Wall time [s] between two syncs to the disk."""


class ChunkedMcapWriter:
    """Writer of one MCAP file; raises OSError if writing fails."""

    def __init__(self, path: Path, clock: Callable[[], float]) -> None:
        """Open the file under its final name, so that it can be repaired after a kill.

        Args:
            path: file to write; an existing file is replaced.
            clock: wall time [s].
        """
        self.message_counts: Counter[str] = Counter()
        """Number of messages by topic."""
        self._clock = clock
        self._chunk_start: int | None = None
        self._chunk_opened_at = self._synced_at = clock()
        self._schemas: dict[str, int] = {}
        self._topics: dict[str, int] = {}
        self._file, self._mcap = _open_writer(path)

    @property
    def topics(self) -> tuple[str, ...]:
        """Registered topics."""
        return tuple(self._topics)

    def register(self, topic: str) -> None:
        """Register a topic with its schema, unless it is registered."""
        if topic in self._topics:
            return
        name = make_schema_name(topic)
        if name not in self._schemas:
            content = orjson.dumps(make_message_schema(topic))
            self._schemas[name] = self._mcap.register_schema(name, "jsonschema", content)
        self._topics[topic] = self._mcap.register_channel(topic, "json", self._schemas[name])

    def write_message(self, topic: str, time_ns: int, message: bytes) -> None:
        """Write one message of a registered topic, at the bench clock [ns]."""
        start = self._chunk_start
        # Faster than real time the bench clock outruns the wall clock; with rare messages it hardly advances.
        if start is not None and (
            time_ns - start >= CHUNK_TIME * NS_PER_SECOND or self._clock() - self._chunk_opened_at >= CHUNK_TIME
        ):
            self._end_chunk()
        if self._chunk_start is None:
            self._chunk_start, self._chunk_opened_at = time_ns, self._clock()
        self._mcap.add_message(self._topics[topic], time_ns, message, time_ns, self.message_counts[topic])
        self.message_counts[topic] += 1

    def write_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record after all messages so far."""
        # The record is written to the file directly, hence the open chunk is closed first.
        flush(self._mcap)
        self._mcap.add_metadata(name, dict(values))

    def attach(self, time_ns: int, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment with the bench clock [ns] as its time."""
        self._mcap.add_attachment(time_ns, time_ns, name, media_type, data)

    def sync(self) -> None:
        """Write everything so far to the disk."""
        flush(self._mcap)
        os.fsync(self._file.fileno())
        self._synced_at = self._clock()

    def abandon(self) -> None:
        """Close the file without writing an index."""
        self._file.close()

    def close(self) -> None:
        """Write the index and sync the file to the disk."""
        with self._file:
            finish(self._mcap)
            self._file.flush()
            os.fsync(self._file.fileno())

    def _end_chunk(self) -> None:
        flush(self._mcap)
        self._chunk_start = None
        if self._clock() - self._synced_at >= SYNC_PERIOD:
            self.sync()


def _open_writer(path: Path) -> tuple[IO[bytes], Writer]:
    file = path.open("wb")
    try:
        return file, start_writer(file)
    except BaseException:
        file.close()
        raise
