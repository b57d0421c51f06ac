"""Messages of a log as columns.

A log contains one JSON message per sample. The messages of a chunk are parsed together, as one JSON array. From
the second reading on, the columns come from the cache (log_cache.py).
"""

import hashlib
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import orjson
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Message, Metadata
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from identification.arrays import Array
from identification.errors import UnreadableLogError
from identification.logs import log_cache
from identification.logs.log_cache import RawLog

SAMPLE_TOPIC, SEGMENT_TOPIC = "/bench/sample", "/bench/segment"

_MAGIC = b"\x89MCAP0\r\n"
_MESSAGE, _CHANNEL = 5, 4
_RECORD = struct.Struct("<BQ")
_CHANNEL_HEAD = struct.Struct("<HHI")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_PARSE_ERRORS = (McapError, struct.error, zstandard.ZstdError, RuntimeError, ValueError, TypeError, KeyError)
"""Errors that the libraries raise for a file that is truncated or not a log."""

Columns = dict[str, Array]


class _Message(NamedTuple):
    channel: int
    time: int
    """Time on the bench clock [ns]."""
    body: bytes


def read_cached(path: Path) -> tuple[RawLog, str]:
    """Return the columns of a log, from the cache if possible, and the SHA-256 of its content in hex.

    Raises:
        UnreadableLogError: the file does not exist, is not an mrbench log, or is truncated.
    """
    try:
        with path.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UnreadableLogError(f"{path}: cannot be opened ({error.strerror}); give the path of a log") from error
    raw = log_cache.read_entry(sha256)
    if raw is None:
        raw = read_log(path)
        log_cache.write_entry(sha256, raw)
    return raw, sha256


def read_log(path: Path) -> RawLog:
    """Read the columns of a log without the cache.

    Raises:
        UnreadableLogError: the file is not an mrbench log, or is truncated.
    """
    try:
        with path.open("rb") as file:
            blocks, segments, metadata = _read_blocks(file)
    except _PARSE_ERRORS as error:
        raise UnreadableLogError(_describe_failure(path, error)) from error
    if not blocks:
        raise UnreadableLogError(
            f"{path}: contains no {SAMPLE_TOPIC} messages; give the log of a run or an import"
        )
    return _join_chunks(blocks, segments, metadata)


def _read_blocks(
    file: IO[bytes],
) -> tuple[list[Columns], list[dict[str, Any]], dict[str, dict[str, str]]]:
    """Return the columns of each chunk, the marks of all segments, and the metadata."""
    topics: dict[int, str] = {}
    metadata: dict[str, dict[str, str]] = {}
    blocks: list[Columns] = []
    segments: list[dict[str, Any]] = []
    for messages in _read_chunks(file, topics, metadata):
        if samples := _select_topic(messages, topics, SAMPLE_TOPIC):
            blocks.append(_make_columns(samples))
        for message in _select_topic(messages, topics, SEGMENT_TOPIC):
            segments.append(orjson.loads(message.body) | {"time": message.time})
    return blocks, segments, metadata


def _describe_failure(path: Path, error: Exception) -> str:
    """Return the reason why a log cannot be parsed."""
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return f"{path}: not an MCAP log; import CSV recordings with `mrbench import`"
    if isinstance(error, orjson.JSONDecodeError):
        return f"{path}: a message is not JSON ({error}); give a log of the profile mrbench"
    return f"{path}: truncated or damaged ({str(error) or type(error).__name__}); run `mrbench salvage {path}`"


def _read_chunks(
    file: IO[bytes], topics: dict[int, str], metadata: dict[str, dict[str, str]]
) -> Iterator[list[_Message]]:
    """Yield the messages of each chunk, and fill in topics by channel and metadata."""
    unchunked: list[_Message] = []
    for record in StreamReader(file, emit_chunks=True).records:
        if isinstance(record, Chunk):
            yield _unpack_chunk(record, topics)
        elif isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Metadata):
            metadata[record.name] = dict(record.metadata)
        # A writer may put messages outside of any chunk.
        elif isinstance(record, Message):
            unchunked.append(_Message(record.channel_id, record.log_time, record.data))
    yield unchunked


def _unpack_chunk(chunk: Chunk, topics: dict[int, str]) -> list[_Message]:
    """Unpack the messages of a chunk in place; one object per record would take three times as long."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(size)
    messages: list[_Message] = []
    position = 0
    while position < size:
        kind, length = _RECORD.unpack_from(data, position)
        position += _RECORD.size
        if kind == _MESSAGE:
            channel, _, time, _ = _MESSAGE_HEAD.unpack_from(data, position)
            messages.append(_Message(channel, time, data[position + _MESSAGE_HEAD.size : position + length]))
        elif kind == _CHANNEL:
            number, _, topic_size = _CHANNEL_HEAD.unpack_from(data, position)
            topics[number] = data[position + _CHANNEL_HEAD.size :][:topic_size].decode()
        position += length
    return messages


def _select_topic(messages: list[_Message], topics: dict[int, str], topic: str) -> list[_Message]:
    # The topics are complete for these messages, because a channel precedes its first message in every log.
    numbers = {number for number, name in topics.items() if name == topic}
    return [message for message in messages if message.channel in numbers]


def _make_columns(messages: list[_Message]) -> Columns:
    """Return one column per field, and `time` [ns]; NaN where a message lacks a field."""
    rows = orjson.loads(b"[" + b",".join([message.body for message in messages]) + b"]")
    names = dict.fromkeys(name for row in rows for name in row if name != "timestamp")
    # numpy converts None to NaN here.
    columns = {name: np.array([row.get(name) for row in rows], float) for name in names}
    return columns | {"time": np.array([message.time for message in messages], np.int64)}


def _join_chunks(
    blocks: list[Columns], segments: list[dict[str, Any]], metadata: dict[str, dict[str, str]]
) -> RawLog:
    """Join all chunks in the order of time, each instant once; a field that a chunk lacks is NaN there."""
    nanoseconds, order = np.unique(np.concatenate([block["time"] for block in blocks]), return_index=True)
    names = dict.fromkeys(name for block in blocks for name in block if name != "time")
    # Subtracted as integers, because nanoseconds since 1970 have more digits than a float.
    samples = {"time": (nanoseconds - nanoseconds[0]) * 1e-9}
    for name in names:
        parts = [block.get(name, np.full(len(block["time"]), np.nan)) for block in blocks]
        samples[name] = np.concatenate(parts)[order]
    for segment in segments:
        segment["time"] = (segment["time"] - int(nanoseconds[0])) * 1e-9
    return RawLog(samples, segments, metadata)
