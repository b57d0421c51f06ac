"""Headers that tell a browser what an answer may do and who may keep it."""

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_COMMON = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
}
# Styles of a report stand in its page, and a report in the frame of a view has the policy of the page.
_PAGE_POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self' ws: wss:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_API_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; frame-ancestors 'none'"
)


class SecurityHeadersMiddleware:
    """ASGI middleware that adds the headers: scripts only of the page, no frames, nothing of the API kept."""

    def __init__(self, app: ASGIApp, *, api: str) -> None:
        """Protect an application; paths below `api` return data, all others the page."""
        self._app, self._api = app, api

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a request by the application and add the headers to its answer."""
        is_api = scope["type"] == "http" and scope["path"].startswith(self._api)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(_COMMON)
                headers["Content-Security-Policy"] = _API_POLICY if is_api else _PAGE_POLICY
                headers["Cache-Control"] = "no-store" if is_api else "no-cache"
            await send(message)

        await self._app(scope, receive, send_with_headers)
