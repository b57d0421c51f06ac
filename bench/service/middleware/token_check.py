"""Check of the token, before anything of the body of a request is read."""

from collections.abc import Container

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from bench.service import problems
from bench.service.context import ServiceContext

_SCHEME = "bearer"
_UNAUTHORISED_HEADERS = {**problems.CLOSE, "WWW-Authenticate": "Bearer"}


class TokenCheckMiddleware:
    """ASGI middleware that refuses every request without the token below one path.

    A check by a route comes too late: the framework reads and parses the body before it.
    """

    def __init__(self, app: ASGIApp, *, below: str, public: Container[str]) -> None:
        """Protect an application.

        Args:
            app: application that receives the permitted requests.
            below: start of all protected paths.
            public: paths that need no token.
        """
        self._app, self._below, self._public = app, below, public

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a permitted request on, and answer any other with 401."""
        if scope["type"] != "http" or self._is_public(scope["path"]) or _has_token(scope):
            await self._app(scope, receive, send)
            return
        # The connection is closed, because a body that nobody wants may follow.
        response = problems.make_response(problems.make_unauthorised(), _UNAUTHORISED_HEADERS)
        await response(scope, receive, send)

    def _is_public(self, path: str) -> bool:
        return not path.startswith(self._below) or path in self._public


def _has_token(scope: Scope) -> bool:
    context: ServiceContext = scope["app"].state.context
    scheme, _, token = Headers(scope=scope).get("authorization", "").partition(" ")
    return scheme.lower() == _SCHEME and context.access.is_allowed(token.strip())
