"""Log of the requests that change something or fail, one line each, without tokens in URLs."""

import logging
import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

_LOG = logging.getLogger(__name__)
_QUIET_METHODS = ("GET", "HEAD")


class RequestLogMiddleware:
    """ASGI middleware that logs requests."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request by the application and log its status."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, status = time.monotonic(), 500

        async def record_status(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, record_status)
        finally:
            if scope["method"] not in _QUIET_METHODS or status >= 400:
                seconds = round(time.monotonic() - began, 4)
                # Only the path, because a query may contain the token.
                record = {"method": scope["method"], "path": scope["path"], "status": status, "seconds": seconds}
                _LOG.info("request", extra=record)
