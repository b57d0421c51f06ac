"""Live messages to every listener; one that is slow gets fewer, the newest, and holds nobody up."""

import asyncio
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import orjson
from pydantic import BaseModel

MAX_QUEUED_EVENTS = 64
"""Events that wait for a slow listener."""
MAX_QUEUED_BATCHES = 4
"""Batches of samples that wait for a slow listener."""


class SubscriberQueue:
    """What waits for one listener, as JSON text; used in the event loop only."""

    def __init__(self) -> None:
        # Of what has a state the newest word is enough; events and samples are each their own, and have an end.
        self._latest: dict[tuple[str, str], str] = {}
        self._events: deque[str] = deque(maxlen=MAX_QUEUED_EVENTS)
        self._samples: deque[str] = deque(maxlen=MAX_QUEUED_BATCHES)
        self._has_messages = asyncio.Event()

    def put(self, topic: str, key: str, text: str) -> None:
        """Take a message; of status, runs and jobs only the latest of each key is kept."""
        if topic == "samples":
            self._samples.append(text)
        elif topic == "event":
            self._events.append(text)
        else:
            self._latest[topic, key] = text
        self._has_messages.set()

    async def take(self) -> list[str]:
        """Everything that waits, as soon as there is something."""
        await self._has_messages.wait()
        self._has_messages.clear()
        waiting = [*self._latest.values(), *self._events, *self._samples]
        self._latest.clear()
        self._events.clear()
        self._samples.clear()
        return waiting


class LiveBroadcaster:
    """Hands what happens to all listeners."""

    def __init__(self) -> None:
        self._queues: set[SubscriberQueue] = set()
        self._last_status: str | None = None

    @contextmanager
    def subscribe(self) -> Iterator[SubscriberQueue]:
        """A mailbox that is filled as long as the context lasts; it begins with the last status."""
        mailbox = SubscriberQueue()
        if self._last_status is not None:
            mailbox.put("status", "", self._last_status)
        self._queues.add(mailbox)
        try:
            yield mailbox
        finally:
            self._queues.discard(mailbox)

    def publish(self, topic: str, text: str, key: str = "") -> None:
        """Hand a message, made by `as_text`, to everybody; in the event loop."""
        if topic == "status":
            self._last_status = text
        for mailbox in self._queues:
            mailbox.put(topic, key, text)

    def make_publisher(self, loop: asyncio.AbstractEventLoop) -> Callable[[str, BaseModel], None]:
        """The same for other threads; once the loop has ended, nobody listens."""

        def publish(topic: str, data: BaseModel) -> None:
            text = serialise_message(topic, data)
            if not loop.is_closed():
                loop.call_soon_threadsafe(self.publish, topic, text)

        return publish


def serialise_message(topic: str, data: BaseModel) -> str:
    """A message as it goes over the websocket."""
    return orjson.dumps({"topic": topic, "data": data.model_dump(mode="json")}).decode()
