"""Live messages to all websocket clients; a slow client gets only the newest and does not delay the others.

Statuses and samples carry the UTC at which they were true. The service sends its own UTC twice a second, so that a
client judges their age independently of its own clock and of the time of arrival.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import orjson
from pydantic import BaseModel

MAX_QUEUED_EVENTS = 64
"""Largest number of events that wait for a slow client."""
CLOCK_PERIOD = 0.5
"""Time between two messages with the UTC of the service [s]."""
MAX_QUEUED_BATCHES = 4
"""Largest number of sample batches that wait for a slow client."""


class SubscriberQueue:
    """Messages that wait for one client, as JSON text; used in the event loop only."""

    def __init__(self) -> None:
        # Of a status, run or job only the latest state matters. Each event and batch counts, up to a limit.
        self._latest: dict[tuple[str, str], str] = {}
        self._events: deque[str] = deque(maxlen=MAX_QUEUED_EVENTS)
        self._samples: deque[str] = deque(maxlen=MAX_QUEUED_BATCHES)
        self._has_messages = asyncio.Event()

    def put(self, topic: str, key: str, text: str) -> None:
        """Add a message; of status, runs and jobs only the latest for each key is kept."""
        if topic == "samples":
            self._samples.append(text)
        elif topic == "event":
            self._events.append(text)
        else:
            self._latest[topic, key] = text
        self._has_messages.set()

    async def take(self) -> list[str]:
        """Wait for messages, and remove and return all of them."""
        await self._has_messages.wait()
        self._has_messages.clear()
        waiting = [*self._latest.values(), *self._events, *self._samples]
        self._latest.clear()
        self._events.clear()
        self._samples.clear()
        return waiting


class LiveBroadcaster:
    """Distributor of messages to all subscribers."""

    def __init__(self) -> None:
        self._queues: set[SubscriberQueue] = set()
        self._last_status: str | None = None

    @contextmanager
    def subscribe(self) -> Iterator[SubscriberQueue]:
        """Return a queue that is filled while the context lasts; it begins with the UTC and the latest status."""
        queue = SubscriberQueue()
        queue.put("clock", "", _make_clock_message())
        if self._last_status is not None:
            queue.put("status", "", self._last_status)
        self._queues.add(queue)
        try:
            yield queue
        finally:
            self._queues.discard(queue)

    def publish(self, topic: str, text: str, key: str = "") -> None:
        """Send a text from `serialise_message` to all subscribers; called in the event loop."""
        if topic == "status":
            self._last_status = text
        for queue in self._queues:
            queue.put(topic, key, text)

    async def publish_clock(self) -> None:
        """Publish the UTC of the service periodically."""
        while True:
            self.publish("clock", _make_clock_message())
            await asyncio.sleep(CLOCK_PERIOD)

    def make_publisher(self, loop: asyncio.AbstractEventLoop) -> Callable[[str, BaseModel], None]:
        """Return a function that publishes from other threads, and does nothing once the loop is closed."""

        def publish(topic: str, data: BaseModel) -> None:
            text = serialise_message(topic, data)
            if not loop.is_closed():
                loop.call_soon_threadsafe(self.publish, topic, text)

        return publish


def _make_clock_message() -> str:
    return orjson.dumps({"topic": "clock", "data": {"utc_s": time.time()}}).decode()


def serialise_message(topic: str, data: BaseModel) -> str:
    """Return the text of a message on the websocket."""
    return orjson.dumps({"topic": topic, "data": data.model_dump(mode="json")}).decode()
