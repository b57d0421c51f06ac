"""Chunks of an MCAP file, with the bodies of their messages by topic.

The mcap package makes one object for each message, which takes longer than everything else in reading a log. Here
it reads the records of the file and unpacks the chunks. Their messages are found in place.
"""

import struct
from collections.abc import Collection, Iterator
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, get_chunk_data_stream

_RECORD = struct.Struct("<BQ")
"""Kind and length of a record."""
_MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, number, log time and publish time of a message."""
_CHANNEL_HEAD = struct.Struct("<HHI")
"""Number, schema and length of the topic of a channel."""

Bodies = dict[str, list[bytes]]
"""Bodies of messages by topic."""


def read_chunks(file: IO[bytes], topics: Collection[str]) -> Iterator[Bodies]:
    """Yield the messages of some topics, chunk by chunk in the order of the file.

    Args:
        file: complete MCAP file, at its start.
        topics: topics of the messages; all others are skipped.

    Raises:
        McapError, CRCValidationError, struct.error: the file is damaged (`DAMAGE_ERRORS`).
    """
    channels: dict[int, str] = {}
    for record in StreamReader(file, emit_chunks=True).records:
        if isinstance(record, Chunk):
            yield _unpack_chunk(record, topics, channels)
        elif isinstance(record, Channel):
            channels[record.id] = record.topic
        # A writer may put messages outside of any chunk.
        elif isinstance(record, Message) and (topic := channels.get(record.channel_id, "")) in topics:
            yield {topic: [record.data]}


def _unpack_chunk(chunk: Chunk, topics: Collection[str], channels: dict[int, str]) -> Bodies:
    """Return the messages of one chunk, and add its channels to those that are known."""
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = stream.read(size)
    bodies: Bodies = {topic: [] for topic in topics}
    position = 0
    while position < size:
        kind, length = _RECORD.unpack_from(data, position)
        position += _RECORD.size
        if kind == Opcode.MESSAGE:
            # A channel precedes its first message.
            topic = channels.get(_MESSAGE_HEAD.unpack_from(data, position)[0], "")
            if topic in topics:
                bodies[topic].append(data[position + _MESSAGE_HEAD.size : position + length])
        elif kind == Opcode.CHANNEL:
            number, _, topic_size = _CHANNEL_HEAD.unpack_from(data, position)
            channels[number] = data[position + _CHANNEL_HEAD.size :][:topic_size].decode()
        position += length
    return bodies
