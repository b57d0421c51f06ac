"""Audit trail of the requests that change something, refused ones too."""

import asyncio
from collections.abc import Container, Sequence
from http import HTTPStatus

from starlette.routing import BaseRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.service import problems
from bench.service.audit import RequestRecord
from bench.service.context import ServiceContext

_READING = ("GET", "HEAD", "OPTIONS", "TRACE")
_URGENT = ("/stop", "/abort")
"""Ends of the paths that stop something: they are executed and answered before anything is recorded."""


class AuditMiddleware:
    """ASGI middleware that records who has asked for what, and with which outcome.

    An answer is sent once its entry is on the disk. If nothing can be recorded, a request is refused; a stop or an
    abort is executed in any case.
    """

    def __init__(self, app: ASGIApp, *, api: str, routes: Sequence[BaseRoute], unrecorded: Container[str]) -> None:
        """Record the requests to an application.

        Args:
            app: the application.
            api: start of all paths of the interface.
            routes: routes of the interface, whose paths do not contain that start.
            unrecorded: paths that change nothing although their method is POST.
        """
        self._app, self._api, self._routes, self._unrecorded = app, api, routes, unrecorded

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request by the application, and record it unless it only reads."""
        if scope["type"] != "http" or not self._is_recorded(scope["method"], scope["path"]):
            await self._app(scope, receive, send)
            return
        context: ServiceContext = scope["app"].state.context
        is_urgent = scope["path"].endswith(_URGENT)
        if not is_urgent and (obstacle := await asyncio.to_thread(context.audit.find_obstacle)):
            await problems.make_response(_refuse(obstacle), problems.CLOSE)(scope, receive, send)
            return
        record = RequestRecord(scope, self._api, self._routes)
        answer = _Answer(record, context, send, is_urgent=is_urgent)
        try:
            with record.as_current():
                await self._app(scope, _record_body(receive, record), answer.send)
        finally:
            await answer.finish()

    def _is_recorded(self, method: str, path: str) -> bool:
        return method not in _READING and path.startswith(self._api) and path not in self._unrecorded


class _Answer:
    """Answer whose first part is held back until the entry is written."""

    def __init__(self, record: RequestRecord, context: ServiceContext, send: Send, *, is_urgent: bool) -> None:
        self._record, self._context, self._send = record, context, send
        self._is_urgent, self._is_written = is_urgent, False
        self._start: Message | None = None

    async def send(self, message: Message) -> None:
        """Send a part of the answer."""
        self._record.take_answer(message)
        if message["type"] == "http.response.start" and not self._is_urgent:
            self._start = message
            return
        if self._start is not None:
            self._is_written = True
            await self._context.audit.write(await self._record.make_act())
            await self._send(self._start)
            self._start = None
        await self._send(message)

    async def finish(self) -> None:
        """Record what is not recorded yet: a stop, or a request that has failed without an answer."""
        if not self._is_written:
            self._context.audit.record(await self._record.make_act())


def _record_body(receive: Receive, record: RequestRecord) -> Receive:
    async def receive_recorded() -> Message:
        message = await receive()
        record.take_body(message)
        return message

    return receive_recorded


def _refuse(obstacle: str) -> problems.ProblemError:
    detail = f"{obstacle}; nothing was done, because it could not be recorded; stop and abort work in any case"
    title = "The audit trail cannot be written"
    return problems.ProblemError(HTTPStatus.SERVICE_UNAVAILABLE, "audit-unwritable", title, detail)
