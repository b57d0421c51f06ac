"""An MCAP file whose chunks are closed by time, so that a kill at any moment costs a fraction of a second.

A chunk is closed after 0.2 s of bench or wall time, whichever comes first, or when it is large; a closed chunk
goes to the operating system at once and to the disk four times a second. What a message means is not known here.
"""

import os
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import orjson

from bench.recorder.columns import SECOND
from bench.recorder.mcap_file import finish, flush, started_writer
from bench.recorder.messages import message_schema, schema_name

CHUNK_TIME = 0.2
"""[s] of bench or wall time after which a chunk is closed."""

SYNC_PERIOD = 0.25
"""[s] of wall time between two syncs to the disk."""


class PacedFile:
    """One file while it is being written; what the system refuses is raised as OSError."""

    def __init__(self, path: Path, clock: Callable[[], float]) -> None:
        """Open it, under its final name: what a kill leaves there can be mended.

        Args:
            path: a file there is replaced.
            clock: wall time [s].
        """
        self.written: Counter[str] = Counter()
        """Messages so far, by topic."""
        self._clock = clock
        self._chunk_start: int | None = None
        self._chunk_opened = self._synced = clock()
        self._schemas: dict[str, int] = {}
        self._topics: dict[str, int] = {}
        self._file = path.open("wb")
        try:
            self._mcap = started_writer(self._file)
        except BaseException:
            self._file.close()
            raise

    @property
    def topics(self) -> tuple[str, ...]:
        """Those that are known."""
        return tuple(self._topics)

    def register(self, topic: str) -> None:
        """Make a topic known, with its schema; harmless when it is."""
        if topic in self._topics:
            return
        name = schema_name(topic)
        if name not in self._schemas:
            content = orjson.dumps(message_schema(topic))
            self._schemas[name] = self._mcap.register_schema(name, "jsonschema", content)
        self._topics[topic] = self._mcap.register_channel(topic, "json", self._schemas[name])

    def put(self, topic: str, time_ns: int, message: bytes) -> None:
        """Write one message of a known topic, at the bench clock [ns]."""
        start = self._chunk_start
        # The bench clock of a log made faster than real time outruns the wall's, that of a slow one stands still.
        if start is not None and (
            time_ns - start >= CHUNK_TIME * SECOND or self._clock() - self._chunk_opened >= CHUNK_TIME
        ):
            self._end_chunk()
        if self._chunk_start is None:
            self._chunk_start, self._chunk_opened = time_ns, self._clock()
        self._mcap.add_message(self._topics[topic], time_ns, message, time_ns, self.written[topic])
        self.written[topic] += 1

    def record(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record, behind all messages so far."""
        # A record goes past the open chunk into the file.
        flush(self._mcap)
        self._mcap.add_metadata(name, dict(values))

    def attach(self, time_ns: int, name: str, media_type: str, data: bytes) -> None:
        """Keep a document, stamped with the bench clock [ns]."""
        self._mcap.add_attachment(time_ns, time_ns, name, media_type, data)

    def to_disk(self) -> None:
        """Bring what was written so far to the disk."""
        flush(self._mcap)
        os.fsync(self._file.fileno())
        self._synced = self._clock()

    def abandon(self) -> None:
        """Close it as it is, without an index."""
        self._file.close()

    def close(self) -> None:
        """Write the index, and bring everything to the disk."""
        with self._file:
            finish(self._mcap)
            self._file.flush()
            os.fsync(self._file.fileno())

    def _end_chunk(self) -> None:
        flush(self._mcap)
        self._chunk_start = None
        if self._clock() - self._synced >= SYNC_PERIOD:
            self.to_disk()
