"""Publications of the agent: status, events and samples for any number of subscribers.

Publishing never waits: a slow subscriber loses messages, but the rig loses nothing.
"""

import threading
from pathlib import Path
from typing import Final, TypeAlias

import orjson
import zmq

from bench.agent_protocol.messages import EVENT, SAMPLES, STATUS, AgentEvent, AgentStatus
from bench.agent_protocol.sockets import BoundSocket
from bench.live import LiveBatch, decode_batch, describe_channels, parse_channels

Publication: TypeAlias = AgentStatus | LiveBatch | AgentEvent
"""Message that the agent publishes."""
_MESSAGE_TYPES: Final[dict[bytes, type[AgentStatus | AgentEvent]]] = {STATUS: AgentStatus, EVENT: AgentEvent}
_TOPICS: Final = {type_: topic for topic, type_ in _MESSAGE_TYPES.items()}


class Publisher(BoundSocket):
    """Publisher of the agent's messages, from any thread, without waiting."""

    def __init__(self, address: str, key: Path | None = None) -> None:
        """Listen for subscribers; arguments and errors as those of every bound socket."""
        super().__init__(zmq.PUB, address, key)
        # A ZeroMQ socket must not be used by two threads at once.
        self._lock = threading.Lock()

    def publish(self, message: Publication) -> None:
        """Send a message to all subscribers; dropped for slow ones, and after the publisher is closed."""
        frames = _serialise(message)
        with self._lock:
            if not self._socket.closed:
                self._socket.send_multipart(frames)

    def __exit__(self, *error: object) -> None:
        with self._lock:
            super().__exit__(*error)


def _serialise(message: Publication) -> list[bytes]:
    """Return the parts of a publication: topic, then JSON, or list of channels and binary batch."""
    if isinstance(message, LiveBatch):
        return [SAMPLES, orjson.dumps(describe_channels(message.channels)), message.encode()]
    return [_TOPICS[type(message)], message.model_dump_json().encode()]


def parse_publication(parts: list[bytes]) -> Publication:
    """Return the publication in the parts of a message.

    Raises:
        LiveDataError: samples of another version.
    """
    if parts[0] == SAMPLES:
        _, channels, content = parts
        return decode_batch(content, parse_channels(channels))
    topic, content = parts
    return _MESSAGE_TYPES[topic].model_validate_json(content)
