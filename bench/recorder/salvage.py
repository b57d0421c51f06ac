"""Mends a log whose recorder was killed: keeps every closed chunk and says what is lost."""

import shutil
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from bench.errors import LogError
from bench.recorder.columns import SECOND
from bench.recorder.header import text_values
from bench.recorder.mcap_file import DAMAGE, MAGIC, file_errors, finish, flush, started_writer
from bench.recorder.messages import MESSAGES, SAMPLE
from bench.recorder.reader import check_profile, read_log
from bench.recorder.replacement import replacing


@dataclass(frozen=True)
class Salvage:
    """What became of a log."""

    path: Path
    """The log that can be read now."""
    was_whole: bool
    """Nothing was wrong, and nothing was done."""
    samples: int
    bytes_dropped: int = 0
    """Bytes of the broken log that hold nothing whole."""
    last_time: float = 0.0
    """[s] bench clock of the last sample kept."""
    known_until: float = 0.0
    """[s] latest bench clock that the broken log speaks of; what lies between was recorded and is lost."""
    broken: Path | None = None
    """Where the broken log is kept, if it was mended in place."""

    def __str__(self) -> str:
        """What became of it, for a person."""
        if self.was_whole:
            return f"{self.path}: the log is whole ({self.samples} samples); nothing to mend"
        lost = max(0.0, self.known_until - self.last_time)
        kept = f"; the broken log is kept as {self.broken}" if self.broken else ""
        return (
            f"{self.path}: {self.samples} samples kept, up to {self.last_time:.3f} s; {self.bytes_dropped} bytes"
            f" dropped, {lost:.3f} s after that known to be lost; a recorder that was killed loses up to 0.5 s"
            f" beyond what its file shows{kept}"
        )


@dataclass
class _Remains:
    """What has been found in a broken log so far."""

    topics: dict[int, str] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    whole_until: int = 0
    """Position after the last whole record [byte]."""
    bad_bytes: int = 0
    """Bytes of chunks that are complete but damaged."""
    last_time_ns: int = 0
    known_until_ns: int = 0


def salvage(path: Path | str, out: Path | str | None = None) -> Salvage:
    """Make a log readable again whose recorder was killed.

    Args:
        path: the broken log.
        out: where the mended log goes; by default it takes the place of the broken one, which is kept under its
            name with ``.broken`` added.

    Raises:
        LogError: it is no log of ours, holds no whole sample, or the mended log cannot be written.
    """
    path = Path(path)
    target = path if out is None else Path(out)
    with file_errors(path), path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError(f"{path}: not an MCAP file; there is nothing to salvage")
        if _is_whole(file):
            return Salvage(path, True, len(read_log(path).samples["time"]))
    broken = path.with_name(f"{path.name}.broken") if out is None else None
    if broken is not None and broken.exists():
        raise LogError(f"{broken}: stands there already; move it away, or give the mended log a name with --out")
    with replacing(target) as beside:
        remains, size = _mend(path, beside)
        read_log(beside)  # before it takes the place of anything
        if broken is not None:
            shutil.copy2(path, broken)
    return Salvage(
        path=target,
        was_whole=False,
        samples=remains.counts[SAMPLE],
        bytes_dropped=_dropped(remains, size),
        last_time=remains.last_time_ns / SECOND,
        known_until=remains.known_until_ns / SECOND,
        broken=broken,
    )


def _is_whole(file: IO[bytes]) -> bool:
    file.seek(0)
    try:
        names = {r.name for r in StreamReader(file, validate_crcs=True).records if isinstance(r, Metadata)}
    except DAMAGE:
        return False
    return "outcome" in names


def _dropped(remains: _Remains, size: int) -> int:
    return size - remains.whole_until + remains.bad_bytes


def _mend(path: Path, beside: Path) -> tuple[_Remains, int]:
    """Write what is whole of a log to another file; also the size of the broken one [byte]."""
    remains = _Remains()
    with file_errors(path), path.open("rb") as file, beside.open("wb") as mended:
        writer = started_writer(mended)
        # In MCAP, schema 0 stands for none.
        schemas: dict[int, int] = {0: 0}
        channels: dict[int, int] = {}
        for record in _whole_records(path, file, remains):
            _copy(record, writer, schemas, channels, remains)
        if not remains.counts[SAMPLE]:
            raise LogError(f"{path}: killed before its first sample was on file; there is nothing to keep")
        size = file.seek(0, 2)
        _look_beyond(file, remains)
        writer.add_metadata("outcome", _outcome(remains, size))
        finish(writer)
    return remains, size


def _whole_records(path: Path, file: IO[bytes], remains: _Remains) -> Iterator[McapRecord | None]:
    """Every whole record outside chunks and in them, and None where a chunk ends."""
    file.seek(0)
    try:
        # Record by record: the library's indexed readers want the end of the file, which is missing here.
        for record in StreamReader(file, emit_chunks=True).records:
            start, remains.whole_until = remains.whole_until, file.tell()
            if isinstance(record, Header):
                check_profile(path, record.profile)
            elif isinstance(record, Chunk):
                remains.known_until_ns = max(remains.known_until_ns, record.message_end_time)
                try:
                    yield from breakup_chunk(record, validate_crc=True)
                    yield None
                except DAMAGE:
                    remains.bad_bytes += remains.whole_until - start
            else:
                yield record
        remains.whole_until = file.tell()
    except DAMAGE:  # cut off here: all that is whole has been handed on
        return


def _copy(
    record: McapRecord | None, writer: Writer, schemas: dict[int, int], channels: dict[int, int], remains: _Remains
) -> None:
    """Write one record of the broken log into the mended one."""
    match record:
        case None:
            flush(writer)
        case Schema() if record.id not in schemas:
            schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
        case Channel() if record.id not in channels and record.schema_id in schemas:
            schema = schemas[record.schema_id]
            channels[record.id] = writer.register_channel(
                record.topic, record.message_encoding, schema, record.metadata
            )
            remains.topics[record.id] = record.topic
        case Message() if record.channel_id in channels:
            channel = channels[record.channel_id]
            writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
            remains.counts[remains.topics[record.channel_id]] += 1
            remains.last_time_ns = max(remains.last_time_ns, record.log_time)
        case Metadata() if record.name != "outcome":
            writer.add_metadata(record.name, record.metadata)
        case Attachment():
            writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)


def _look_beyond(file: IO[bytes], remains: _Remains) -> None:
    """Take from the head of a chunk that was cut off up to when it reached."""
    file.seek(remains.whole_until)
    head = file.read(25)
    # Kind (1 byte), length (8), then the times of its first and last message (8 each).
    if len(head) == 25 and head[0] == Opcode.CHUNK:
        remains.known_until_ns = max(remains.known_until_ns, *struct.unpack("<QQ", head[9:]))


def _outcome(remains: _Remains, size: int) -> dict[str, str]:
    known = max(remains.known_until_ns, remains.last_time_ns)
    return text_values(
        {
            "outcome": "truncated",
            "reason": "the recorder was killed; mended by salvage",
            **{topic: remains.counts[topic] for topic in {**MESSAGES, **remains.counts}},
            "lost": {},
            "last_time_ns": remains.last_time_ns,
            "known_until_ns": known,
            "seconds_lost": (known - remains.last_time_ns) / SECOND,
            "bytes_dropped": _dropped(remains, size),
        }
    )
