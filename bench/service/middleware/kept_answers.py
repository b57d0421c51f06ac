"""Answers that are kept while nothing has changed that they show."""

import asyncio
from collections import OrderedDict
from collections.abc import Container
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakValueDictionary

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.service.context import ServiceContext, Shown

_MAX_ANSWERS = 128
_MAX_BYTES = 1 << 20
"""Size above which an answer is not kept [bytes]."""


@dataclass
class _Answer:
    """Messages of an answer, and what they show."""

    shown: Shown
    endpoint: Any = None
    messages: list[Message] = field(default_factory=list)

    @property
    def is_small_success(self) -> bool:
        size = sum(len(message.get("body", b"")) for message in self.messages)
        return bool(self.messages) and self.messages[0]["status"] == 200 and size <= _MAX_BYTES


class KeptAnswerMiddleware:
    """ASGI middleware that repeats the answer to a GET until what it shows changes.

    Programs ask for the same lists many times a second. What a list shows is read from the catalogue only once
    after each change, so that these requests leave the processor to the run in progress.
    """

    def __init__(self, app: ASGIApp, *, catalogue: Container[str], status: Container[str]) -> None:
        """Serve an application.

        Args:
            app: application that makes the answers.
            catalogue: paths whose answers depend on nothing but catalogue and query.
            status: paths whose answers depend on nothing but catalogue, the agents' statuses and query.
        """
        self._app, self._catalogue, self._status = app, catalogue, status
        self._answers: OrderedDict[tuple[str, bytes], _Answer] = OrderedDict()
        self._locks: WeakValueDictionary[tuple[str, bytes], asyncio.Lock] = WeakValueDictionary()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Repeat the kept answer, or have it made and keep it."""
        # Read before the answer is made: a change meanwhile then only makes the next request read again.
        shown = self._find_shown(scope) if scope["type"] == "http" and scope["method"] == "GET" else None
        if shown is None:
            await self._app(scope, receive, send)
            return
        key = scope["path"], scope["query_string"]
        # Equal requests at once wait for the answer of the first.
        async with self._locks.setdefault(key, asyncio.Lock()):
            kept = self._answers.get(key)
            if kept is None or not kept.shown.is_same(shown):
                await self._make(key, shown, scope, receive, send)
                return
        scope["endpoint"] = kept.endpoint  # for the metrics
        for message in kept.messages:
            await send(_copy(message))

    def _find_shown(self, scope: Scope) -> Shown | None:
        """Return what the answer at the path of a request shows; None if it may show anything else."""
        path = scope["path"]
        context: ServiceContext = scope["app"].state.context
        if path in self._status:
            return context.find_shown()
        return context.find_shown_catalogue() if path in self._catalogue else None

    async def _make(
        self, key: tuple[str, bytes], shown: Shown, scope: Scope, receive: Receive, send: Send
    ) -> None:
        answer = _Answer(shown)

        async def send_and_keep(message: Message) -> None:
            answer.messages.append(_copy(message))
            await send(message)

        await self._app(scope, receive, send_and_keep)
        if answer.is_small_success:
            answer.endpoint = scope.get("endpoint")
            self._answers[key] = answer
            self._answers.move_to_end(key)
            if len(self._answers) > _MAX_ANSWERS:
                self._answers.popitem(last=False)


def _copy(message: Message) -> Message:
    """Return a message with headers of its own, because outer middleware adds to those that it is sent."""
    return {**message, "headers": list(message["headers"])} if "headers" in message else message
