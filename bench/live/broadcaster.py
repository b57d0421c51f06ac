"""Distribution of live messages to all listeners of the service.

Statuses and batches carry the UTC at which they were true. The service sends its own UTC twice a second, so that a
listener judges their age independently of its own clock and of the time of arrival.
"""

import asyncio
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import orjson
from pydantic import BaseModel

from bench.live.batch import LiveBatch
from bench.live.listener import Listener, ListenerSettings

CLOCK_PERIOD = 0.5
"""Time between two messages with the UTC of the service [s]."""


class LiveBroadcaster:
    """Distributor of messages to all listeners."""

    def __init__(self) -> None:
        self._listeners: set[Listener] = set()
        self._last_status: str | None = None
        self._last_batch: LiveBatch | None = None

    @contextmanager
    def listen(self, settings: ListenerSettings | None = None) -> Iterator[Listener]:
        """Return a listener that gets messages while the context lasts.

        It begins with the UTC, the latest status and the latest batch, whose stamps tell a late joiner their age.
        """
        listener = Listener(settings or ListenerSettings())
        listener.put("clock", "", _make_clock_message())
        if self._last_status is not None:
            listener.put("status", "", self._last_status)
        if self._last_batch is not None:
            listener.put_batch(self._last_batch)
        self._listeners.add(listener)
        try:
            yield listener
        finally:
            self._listeners.discard(listener)

    @property
    def count(self) -> int:
        """Number of listeners."""
        return len(self._listeners)

    def publish(self, topic: str, text: str, key: str = "") -> None:
        """Send a text from `serialise_message` to all listeners; called in the event loop."""
        if topic == "status":
            self._last_status = text
        for listener in self._listeners:
            listener.put(topic, key, text)

    def publish_batch(self, batch: LiveBatch) -> None:
        """Send a batch to all listeners; called in the event loop."""
        self._last_batch = batch
        for listener in self._listeners:
            listener.put_batch(batch)

    async def publish_clock(self) -> None:
        """Publish the UTC of the service periodically."""
        while True:
            self.publish("clock", _make_clock_message())
            await asyncio.sleep(CLOCK_PERIOD)

    def make_publisher(self, loop: asyncio.AbstractEventLoop) -> Callable[[str, BaseModel | LiveBatch], None]:
        """Return a function that publishes from other threads, and does nothing once the loop is closed."""

        def publish(topic: str, data: BaseModel | LiveBatch) -> None:
            if loop.is_closed():
                return
            if isinstance(data, LiveBatch):
                loop.call_soon_threadsafe(self.publish_batch, data)
            else:
                loop.call_soon_threadsafe(self.publish, topic, serialise_message(topic, data))

        return publish


def _make_clock_message() -> str:
    return orjson.dumps({"topic": "clock", "data": {"utc_s": time.time()}}).decode()


def serialise_message(topic: str, data: BaseModel) -> str:
    """Return the text of a message on the websocket."""
    return orjson.dumps({"topic": topic, "data": data.model_dump(mode="json")}).decode()
