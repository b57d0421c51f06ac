"""One line for every call that changes something or fails; a token in an address is never written down."""

import logging
import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

_LOG = logging.getLogger(__name__)
_QUIET_METHODS = ("GET", "HEAD")


class RequestLogMiddleware:
    """Wraps an application."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, and write down what came of it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, status = time.monotonic(), 500

        async def note(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, note)
        finally:
            if scope["method"] not in _QUIET_METHODS or status >= 400:
                took = round(time.monotonic() - began, 4)
                # The path alone: a query may hold the token.
                said = {"method": scope["method"], "path": scope["path"], "status": status, "seconds": took}
                _LOG.info("request", extra=said)
