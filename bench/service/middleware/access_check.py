"""Check of who sends a request and of the right to it, before anything of its body is read."""

import asyncio
import hmac
from collections.abc import Container
from http import HTTPStatus

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from bench.catalogue import CatalogueUnavailableError
from bench.service import problems
from bench.service.access import CredentialKind, Identity, OperationRights, compute_csrf, read_cookie
from bench.service.context import ServiceContext

_SCHEME = "bearer"
_SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
_UNAUTHORISED_HEADERS = {**problems.CLOSE, "WWW-Authenticate": "Bearer"}
CSRF_HEADER = "x-csrf-token"


class AccessCheckMiddleware:
    """ASGI middleware that refuses every request below one path without sign-in or without the right to it.

    A check by a route comes too late: the framework reads and parses the body before it. The identity is left in
    the state of the request, as `identity`, with its name for records, as `actor`.
    """

    def __init__(self, app: ASGIApp, *, below: str, public: Container[str]) -> None:
        """Protect an application.

        Args:
            app: application that receives the permitted requests.
            below: start of all protected paths.
            public: operations that need no sign-in, such as ``GET /api/v1/health``.
        """
        self._app, self._below, self._public = app, below, public
        self._rights = OperationRights(below)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a permitted request on, and answer any other with 401 or 403."""
        if scope["type"] != "http" or not scope["path"].startswith(self._below):
            await self._app(scope, receive, send)
            return
        identity, outage = await _identify(scope)
        scope.setdefault("state", {}).update(identity=identity, actor=identity.actor if identity else "")
        verb = "GET" if scope["method"] == "HEAD" else scope["method"]
        is_public = f"{verb} {scope['path']}" in self._public
        problem = None if is_public else self._find_problem(scope, identity)
        if problem is not None and outage is not None:
            problem = outage
        if problem is None:
            await self._app(scope, receive, send)
            return
        # The connection is closed, because a body that nobody wants may follow.
        is_unknown = problem.problem.status == HTTPStatus.UNAUTHORIZED
        headers = _UNAUTHORISED_HEADERS if is_unknown else problems.CLOSE
        await problems.make_response(problem, headers)(scope, receive, send)

    def _find_problem(self, scope: Scope, identity: Identity | None) -> problems.ProblemError | None:
        if identity is None:
            return problems.make_unauthorised()
        if identity.session is not None and not _has_csrf_value(scope):
            return problems.make_csrf_missing()
        right = self._rights.find(scope["method"], scope["path"], lambda name: _may_be_tripped(scope, name))
        return None if right in identity.rights else problems.make_right_missing(right, identity)


def _may_be_tripped(scope: Scope, name: str | None) -> bool:
    """Return whether the trip of a bench may be latched; without a name the only bench is meant."""
    context: ServiceContext = scope["app"].state.context
    bench = context.benches.find(name)
    if bench is None:  # the route refuses the request
        return False
    status = bench.monitor.latest_status
    return status is None or status.state == "tripped"  # an unknown state may be a trip


async def _identify(scope: Scope) -> tuple[Identity | None, problems.ProblemError | None]:
    """Return who sends a request, and the problem if the catalogue cannot tell; a known person may then stop."""
    context: ServiceContext = scope["app"].state.context
    credential = _read_credential(scope)
    if credential is None:
        return None, None
    # The event loop must not wait for the database; a stop may follow at any moment.
    known = context.authenticator.recall(*credential)
    try:
        return known or await asyncio.to_thread(context.authenticator.identify, *credential), None
    except CatalogueUnavailableError as error:
        return context.authenticator.recall_for_stop(*credential), problems.make_bench_problem(error)


def _read_credential(scope: Scope) -> tuple[CredentialKind, str] | None:
    authorization = Headers(scope=scope).get("authorization")
    if authorization is None:
        secret = read_cookie(scope)
        return None if secret is None else ("session", secret)
    scheme, _, token = authorization.partition(" ")
    return ("token", token.strip()) if scheme.lower() == _SCHEME else None


def _has_csrf_value(scope: Scope) -> bool:
    """Return whether a request with a cookie changes nothing, or comes from the page."""
    if scope["method"] in _SAFE_METHODS:
        return True
    given = Headers(scope=scope).get(CSRF_HEADER, "")
    return hmac.compare_digest(given.encode(), compute_csrf(read_cookie(scope) or "").encode())
