"""Reads a log's messages into columns.

A log holds one JSON message a sample; those of one chunk are parsed together, as one JSON array. The second
reading of the same content comes from the cache (log_cache.py).
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

from identification import log_cache
from identification.arrays import Array
from identification.errors import LogUnreadable
from identification.log_cache import RawLog

SAMPLES, SEGMENTS = "/bench/sample", "/bench/segment"

_MAGIC = b"\x89MCAP0\r\n"
_MESSAGE, _CHANNEL = 5, 4
_RECORD = struct.Struct("<BQ")
_CHANNEL_HEAD = struct.Struct("<HHI")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_BROKEN = (McapError, struct.error, zstandard.ZstdError, RuntimeError, ValueError, TypeError, KeyError)
"""What the libraries raise at a file that breaks off or is no log."""

Columns = dict[str, Array]


class _Message(NamedTuple):
    channel: int
    time: int
    """[ns] bench clock."""
    body: bytes


def read_cached(path: Path) -> tuple[RawLog, str]:
    """A log's columns and the SHA-256 of its content.

    Args:
        path: of the log.

    Returns:
        The columns, from the cache where this content was read before, and the digest in hex.

    Raises:
        LogUnreadable: no such file, no log of ours, or truncated.
    """
    try:
        with path.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise LogUnreadable(f"{path}: cannot be opened ({error.strerror}); give the path of a log") from error
    raw = log_cache.recall(sha256)
    if raw is None:
        raw = read(path)
        log_cache.keep(sha256, raw)
    return raw, sha256


def read(path: Path) -> RawLog:
    """A log's columns, read from the log itself.

    Args:
        path: of the log.

    Returns:
        The columns.

    Raises:
        LogUnreadable: no log of ours, or truncated.
    """
    topics: dict[int, str] = {}
    metadata: dict[str, dict[str, str]] = {}
    blocks: list[Columns] = []
    segments: list[dict[str, Any]] = []
    try:
        with path.open("rb") as file:
            for messages in _message_blocks(file, topics, metadata):
                if samples := _of_topic(messages, topics, SAMPLES):
                    blocks.append(_columns(samples))
                for message in _of_topic(messages, topics, SEGMENTS):
                    segments.append(orjson.loads(message.body) | {"time": message.time})
    except _BROKEN as error:
        raise LogUnreadable(_complaint(path, error)) from error
    if not blocks:
        raise LogUnreadable(f"{path}: holds no {SAMPLES} messages; give the log of a run or an import")
    return _joined(blocks, segments, metadata)


def _complaint(path: Path, error: Exception) -> str:
    """One line on a log that cannot be parsed."""
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return f"{path}: is no MCAP log; CSV recordings come in by `mrbench import`"
    if isinstance(error, orjson.JSONDecodeError):
        return f"{path}: a message is no JSON ({error}); give a log of the profile mrbench"
    return f"{path}: is truncated or damaged ({str(error) or type(error).__name__}); run `mrbench salvage {path}`"


def _message_blocks(
    file: IO[bytes], topics: dict[int, str], metadata: dict[str, dict[str, str]]
) -> Iterator[list[_Message]]:
    """The messages chunk by chunk; topics by channel and metadata are filled in on the way."""
    loose: list[_Message] = []
    for record in StreamReader(file, emit_chunks=True).records:
        if isinstance(record, Chunk):
            yield _in_chunk(record, topics)
        elif isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Metadata):
            metadata[record.name] = dict(record.metadata)
        # A writer may leave messages outside of any chunk.
        elif isinstance(record, Message):
            loose.append(_Message(record.channel_id, record.log_time, record.data))
    yield loose


def _in_chunk(chunk: Chunk, topics: dict[int, str]) -> list[_Message]:
    """The messages of a chunk, unpacked in place: an object a record would take three times as long."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(size)
    messages: list[_Message] = []
    place = 0
    while place < size:
        kind, length = _RECORD.unpack_from(data, place)
        place += _RECORD.size
        if kind == _MESSAGE:
            channel, _, time, _ = _MESSAGE_HEAD.unpack_from(data, place)
            messages.append(_Message(channel, time, data[place + _MESSAGE_HEAD.size : place + length]))
        elif kind == _CHANNEL:
            number, _, letters = _CHANNEL_HEAD.unpack_from(data, place)
            topics[number] = data[place + _CHANNEL_HEAD.size :][:letters].decode()
        place += length
    return messages


def _of_topic(messages: list[_Message], topics: dict[int, str], topic: str) -> list[_Message]:
    # Complete for these messages: a channel stands before its first message in every log.
    numbers = {number for number, name in topics.items() if name == topic}
    return [message for message in messages if message.channel in numbers]


def _columns(messages: list[_Message]) -> Columns:
    """One column a field, and `time` [ns]; NaN where a message lacks a field."""
    rows = orjson.loads(b"[" + b",".join([message.body for message in messages]) + b"]")
    names = dict.fromkeys(name for row in rows for name in row if name != "timestamp")
    # numpy makes NaN of None here.
    columns = {name: np.array([row.get(name) for row in rows], float) for name in names}
    return columns | {"time": np.array([message.time for message in messages], np.int64)}


def _joined(blocks: list[Columns], segments: list[dict[str, Any]], metadata: dict[str, dict[str, str]]) -> RawLog:
    """All chunks in order of time, each instant once; a field that a chunk lacks is NaN there."""
    nanoseconds, order = np.unique(np.concatenate([block["time"] for block in blocks]), return_index=True)
    names = dict.fromkeys(name for block in blocks for name in block if name != "time")
    # Taken off as integers: nanoseconds since 1970 have more digits than a float.
    samples = {"time": (nanoseconds - nanoseconds[0]) * 1e-9}
    for name in names:
        parts = [block.get(name, np.full(len(block["time"]), np.nan)) for block in blocks]
        samples[name] = np.concatenate(parts)[order]
    for segment in segments:
        segment["time"] = (segment["time"] - int(nanoseconds[0])) * 1e-9
    return RawLog(samples, segments, metadata)
