"""Live messages to every listener; one that is slow gets fewer, the newest, and holds nobody up."""

import asyncio
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import orjson
from pydantic import BaseModel

EVENTS_KEPT = 64
"""Events that wait for a slow listener."""
BATCHES_KEPT = 4
"""Batches of samples that wait for a slow listener."""


class Mailbox:
    """What waits for one listener, as JSON text; used in the event loop only."""

    def __init__(self) -> None:
        # Of what has a state the newest word is enough; events and samples are each their own, and have an end.
        self._latest: dict[tuple[str, str], str] = {}
        self._events: deque[str] = deque(maxlen=EVENTS_KEPT)
        self._samples: deque[str] = deque(maxlen=BATCHES_KEPT)
        self._filled = asyncio.Event()

    def put(self, topic: str, key: str, text: str) -> None:
        """Take a message; of status, runs and jobs only the latest of each key is kept."""
        if topic == "samples":
            self._samples.append(text)
        elif topic == "event":
            self._events.append(text)
        else:
            self._latest[topic, key] = text
        self._filled.set()

    async def take(self) -> list[str]:
        """Everything that waits, as soon as there is something."""
        await self._filled.wait()
        self._filled.clear()
        waiting = [*self._latest.values(), *self._events, *self._samples]
        self._latest.clear()
        self._events.clear()
        self._samples.clear()
        return waiting


class Live:
    """Hands what happens to all listeners."""

    def __init__(self) -> None:
        self._mailboxes: set[Mailbox] = set()
        self._last_status: str | None = None

    @contextmanager
    def listener(self) -> Iterator[Mailbox]:
        """A mailbox that is filled as long as the context lasts; it begins with the last status."""
        mailbox = Mailbox()
        if self._last_status is not None:
            mailbox.put("status", "", self._last_status)
        self._mailboxes.add(mailbox)
        try:
            yield mailbox
        finally:
            self._mailboxes.discard(mailbox)

    def publish(self, topic: str, text: str, key: str = "") -> None:
        """Hand a message, made by `as_text`, to everybody; in the event loop."""
        if topic == "status":
            self._last_status = text
        for mailbox in self._mailboxes:
            mailbox.put(topic, key, text)

    def publisher(self, loop: asyncio.AbstractEventLoop) -> Callable[[str, BaseModel], None]:
        """The same for other threads; once the loop has ended, nobody listens."""

        def publish(topic: str, data: BaseModel) -> None:
            text = as_text(topic, data)
            if not loop.is_closed():
                loop.call_soon_threadsafe(self.publish, topic, text)

        return publish


def as_text(topic: str, data: BaseModel) -> str:
    """A message as it goes over the websocket."""
    return orjson.dumps({"topic": topic, "data": data.model_dump(mode="json")}).decode()
