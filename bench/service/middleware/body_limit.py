"""Limit on the size of the body of a request."""

from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.service import problems

MAX_BODY_SIZE = 4 * 1024 * 1024
"""Largest body [bytes]: a method with a table of 100 000 rows has about 3 MB."""


class BodyLimitMiddleware:
    """ASGI middleware that refuses a body above a limit, and holds no more of it than the limit."""

    def __init__(
        self, app: ASGIApp, *, limit: int = MAX_BODY_SIZE, paths: Mapping[str, int] | None = None
    ) -> None:
        """Protect an application.

        Args:
            app: application that receives the bodies.
            limit: largest size [bytes].
            paths: largest size of the paths with another limit, whose routes write the body to the disk.
        """
        self._app, self._limit, self._paths = app, limit, paths or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a body by its declared size, otherwise count it while it is read."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit = self._paths.get(scope["path"], self._limit)
        if _read_declared_size(scope) > limit:
            response = problems.make_response(problems.make_too_large(limit), problems.CLOSE)
            await response(scope, receive, send)
        else:
            await self._app(scope, _count(receive, limit), send)


def _count(receive: Receive, limit: int) -> Receive:
    """Return a function that receives a body and raises an error once it exceeds the limit."""
    size = 0

    async def receive_counted() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        if size > limit:
            raise problems.BodyTooLargeError(limit)
        return message

    return receive_counted


def _read_declared_size(scope: Scope) -> int:
    """Return the declared size of a body [bytes]; zero without one."""
    text = Headers(scope=scope).get("content-length", "0")
    return int(text) if text.isdecimal() else 0
