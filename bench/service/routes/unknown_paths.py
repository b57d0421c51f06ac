"""Answer to requests that no route of the interface handles: 404, or 405 with the methods of the path."""

from collections.abc import Iterator, Sequence
from http import HTTPStatus

from fastapi import FastAPI, Request
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Match

_METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
_ANSWERED = (*_METHODS, "HEAD", "OPTIONS", "TRACE")


def refuse_unknown_paths(app: FastAPI, below: str) -> None:
    """Add the answer to an application whose routes are complete; otherwise the files of the page would answer.

    Args:
        app: the application.
        below: start of the paths of the interface.
    """
    routes = tuple(app.router.routes)

    async def refuse(request: Request) -> None:
        allowed = list(_find_methods(routes, request))
        if not allowed:
            raise HTTPException(HTTPStatus.NOT_FOUND, "there is no such path; openapi.json lists all")
        names = ", ".join(allowed)
        raise HTTPException(HTTPStatus.METHOD_NOT_ALLOWED, f"this path has {names}", {"Allow": names})

    app.add_api_route(f"{below}{{rest:path}}", refuse, methods=list(_ANSWERED), include_in_schema=False)


def _find_methods(routes: Sequence[BaseRoute], request: Request) -> Iterator[str]:
    """Yield the methods that the path of a request has; HEAD wherever there is GET."""
    for method in _METHODS:
        scope = {**request.scope, "method": method}
        if any(route.matches(scope)[0] is Match.FULL for route in routes):
            yield from (method, "HEAD") if method == "GET" else (method,)
