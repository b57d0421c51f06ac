"""Number and duration of requests by operation, for Prometheus."""

import time

from prometheus_client import CollectorRegistry, Histogram
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class RequestMetricsMiddleware:
    """ASGI middleware that measures requests.

    They are counted by the name of the function that answers, so that identifiers do not multiply the series.
    """

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        self._durations = Histogram(
            "mrbench_request_duration_seconds",
            "Duration of requests",
            ["method", "operation", "status"],
            registry=registry,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request by the application and measure its duration."""
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
            operation = getattr(scope.get("endpoint"), "__name__", "other")
            self._durations.labels(scope["method"], operation, str(status)).observe(time.monotonic() - began)
