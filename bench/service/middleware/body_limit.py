"""Limit on the size of the body of a request."""

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.service import problems

MAX_BODY_SIZE = 4 * 1024 * 1024
"""Largest body [bytes]: a method with a table of 100 000 rows has about 3 MB."""


class BodyLimitMiddleware:
    """ASGI middleware that refuses a body above a limit, and holds no more of it than the limit."""

    def __init__(self, app: ASGIApp, *, limit: int = MAX_BODY_SIZE) -> None:
        """Protect an application; the limit is in bytes."""
        self._app, self._limit = app, limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a body by its declared size, otherwise count it while it is read."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif _read_declared_size(scope) > self._limit:
            response = problems.make_response(problems.make_too_large(self._limit), problems.CLOSE)
            await response(scope, receive, send)
        else:
            await self._app(scope, self._count(receive), send)

    def _count(self, receive: Receive) -> Receive:
        """Return a function that receives a body and raises an error once it exceeds the limit."""
        size = 0

        async def receive_counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > self._limit:
                raise problems.BodyTooLargeError(self._limit)
            return message

        return receive_counted


def _read_declared_size(scope: Scope) -> int:
    """Return the declared size of a body [bytes]; zero without one."""
    text = Headers(scope=scope).get("content-length", "0")
    return int(text) if text.isdecimal() else 0
