"""Repair of a truncated log from its intact chunks, with a report of what was lost."""

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

from bench.errors import EmptyLogError, LogError
from bench.log.atomic_file import write_atomically
from bench.log.header import serialise_values
from bench.log.mcap_file import DAMAGE_ERRORS, MAGIC, convert_file_errors, finish, flush, start_writer
from bench.log.messages import MESSAGES, NS_PER_SECOND, SAMPLE
from bench.log.reader import check_profile, read_log


@dataclass(frozen=True)
class SalvageResult:
    """Result of a repair."""

    path: Path
    """Log that can be read now."""
    was_complete: bool
    """True if there was nothing to repair."""
    samples: int
    """Samples in the log."""
    bytes_dropped: int = 0
    """Bytes of the truncated log outside of intact records."""
    duration: float = 0.0
    """Time [s] from the first to the last sample kept; the bench clock may have started weeks before."""
    last_time: float = 0.0
    """Bench clock [s] of the last sample kept."""
    known_until: float = 0.0
    """Latest bench clock [s] in the truncated log; samples after `last_time` were recorded and are lost."""
    backup: Path | None = None
    """Copy of the truncated log, if it was repaired in place."""

    def __str__(self) -> str:
        """Return a description for a person."""
        if self.was_complete:
            return f"{self.path}: the log is complete ({self.samples} samples); nothing to repair"
        lost = max(0.0, self.known_until - self.last_time)
        backup = f"; the truncated log is kept as {self.backup}" if self.backup else ""
        return (
            f"{self.path}: {self.samples} samples kept, {self.duration:.1f} s; {self.bytes_dropped} bytes dropped,"
            f" {lost:.3f} s after them are known to be lost; a killed recorder loses up to 0.5 s more"
            f" than its file shows{backup}"
        )


@dataclass
class _SalvageState:
    """Intermediate state of a repair."""

    topics: dict[int, str] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    intact_end: int = 0
    """Position after the last intact record [byte]."""
    damaged_bytes: int = 0
    """Bytes of chunks that are complete but damaged."""
    first_sample_ns: int = -1
    """Bench clock of the first sample [ns]; negative without one."""
    last_sample_ns: int = -1
    last_time_ns: int = 0
    known_until_ns: int = 0


def salvage_log(path: Path | str, out: Path | str | None = None) -> SalvageResult:
    """Repair a truncated log.

    Args:
        path: truncated log.
        out: repaired log; by default it replaces the truncated one, which is kept with ``.broken`` added to its
            name.

    Raises:
        EmptyLogError: the file contains no intact sample.
        LogError: the file is not an mrbench log, or the repaired log cannot be written.
    """
    path = Path(path)
    target = path if out is None else Path(out)
    with convert_file_errors(path), path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError(f"{path}: not an MCAP file; give a log that `mrbench run` wrote")
        if _is_complete(file):
            return SalvageResult(path, True, len(read_log(path).samples["time"]))
    backup = path.with_name(f"{path.name}.broken") if out is None else None
    if backup is not None and backup.exists():
        raise LogError(f"{backup}: the file exists; move it, or give the repaired log another name with --out")
    with write_atomically(target) as partial:
        state, size = _copy_intact(path, partial)
        read_log(partial)  # raises an error before an existing file is replaced
        if backup is not None:
            shutil.copy2(path, backup)
    return SalvageResult(
        path=target,
        was_complete=False,
        samples=state.counts[SAMPLE],
        bytes_dropped=_count_dropped_bytes(state, size),
        duration=(state.last_sample_ns - state.first_sample_ns) / NS_PER_SECOND,
        last_time=state.last_time_ns / NS_PER_SECOND,
        known_until=state.known_until_ns / NS_PER_SECOND,
        backup=backup,
    )


def _is_complete(file: IO[bytes]) -> bool:
    file.seek(0)
    try:
        names = {r.name for r in StreamReader(file, validate_crcs=True).records if isinstance(r, Metadata)}
    except DAMAGE_ERRORS:
        return False
    return "outcome" in names


def _count_dropped_bytes(state: _SalvageState, size: int) -> int:
    return size - state.intact_end + state.damaged_bytes


def _copy_intact(path: Path, out: Path) -> tuple[_SalvageState, int]:
    """Copy all intact records of a log to another file; also return the size of the log [byte]."""
    state = _SalvageState()
    with convert_file_errors(path), path.open("rb") as file, out.open("wb") as repaired:
        writer = start_writer(repaired)
        # In MCAP, schema 0 means no schema.
        schemas: dict[int, int] = {0: 0}
        channels: dict[int, int] = {}
        for record in _read_intact_records(path, file, state):
            _copy_record(record, writer, schemas, channels, state)
        if not state.counts[SAMPLE]:
            raise EmptyLogError(
                f"{path}: the recorder was killed before it wrote a sample; there is nothing to keep"
            )
        size = file.seek(0, 2)
        _read_cut_chunk(file, state)
        writer.add_metadata("outcome", _make_outcome(state, size))
        finish(writer)
    return state, size


def _read_intact_records(path: Path, file: IO[bytes], state: _SalvageState) -> Iterator[McapRecord | None]:
    """Yield every intact record outside and inside of chunks, and None at the end of a chunk."""
    file.seek(0)
    try:
        # Record by record: the library's indexed readers need the end of the file, which is missing.
        for record in StreamReader(file, emit_chunks=True).records:
            start, state.intact_end = state.intact_end, file.tell()
            if isinstance(record, Header):
                check_profile(path, record.profile)
            elif isinstance(record, Chunk):
                yield from _read_chunk(record, state.intact_end - start, state)
            else:
                yield record
        state.intact_end = file.tell()
    except DAMAGE_ERRORS:  # the file is truncated here
        return


def _read_chunk(chunk: Chunk, size: int, state: _SalvageState) -> Iterator[McapRecord | None]:
    """Yield the records of a chunk, and None at its end; a damaged chunk counts with its size [bytes]."""
    state.known_until_ns = max(state.known_until_ns, chunk.message_end_time)
    try:
        yield from breakup_chunk(chunk, validate_crc=True)
        yield None
    except DAMAGE_ERRORS:
        state.damaged_bytes += size


def _copy_record(
    record: McapRecord | None,
    writer: Writer,
    schemas: dict[int, int],
    channels: dict[int, int],
    state: _SalvageState,
) -> None:
    """Write one record of the truncated log to the repaired one."""
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
            state.topics[record.id] = record.topic
        case Message() if record.channel_id in channels:
            channel = channels[record.channel_id]
            writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
            _note_sample(state, state.topics[record.channel_id], record.log_time)
            state.last_time_ns = max(state.last_time_ns, record.log_time)
        case Metadata() if record.name != "outcome":
            writer.add_metadata(record.name, record.metadata)
        case Attachment():
            writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)


def _note_sample(state: _SalvageState, topic: str, time_ns: int) -> None:
    state.counts[topic] += 1
    if topic == SAMPLE:
        state.last_sample_ns = time_ns
        state.first_sample_ns = time_ns if state.first_sample_ns < 0 else state.first_sample_ns


def _read_cut_chunk(file: IO[bytes], state: _SalvageState) -> None:
    """Read from the header of the truncated chunk the time of its last message."""
    file.seek(state.intact_end)
    head = file.read(25)
    # Kind (1 byte), length (8), then the times of its first and last message (8 each).
    if len(head) == 25 and head[0] == Opcode.CHUNK:
        state.known_until_ns = max(state.known_until_ns, *struct.unpack("<QQ", head[9:]))


def _make_outcome(state: _SalvageState, size: int) -> dict[str, str]:
    known = max(state.known_until_ns, state.last_time_ns)
    return serialise_values(
        {
            "outcome": "truncated",
            "reason": "the recorder was killed; repaired by salvage",
            **{topic: state.counts[topic] for topic in {**MESSAGES, **state.counts}},
            "lost": {},
            "last_time_ns": state.last_time_ns,
            "known_until_ns": known,
            "seconds_lost": (known - state.last_time_ns) / NS_PER_SECOND,
            "bytes_dropped": _count_dropped_bytes(state, size),
        }
    )
