"""Refusal of query parameters that a route does not know."""

from collections.abc import Iterator
from http import HTTPStatus

from fastapi import Request
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from bench.service.problems import ProblemError, shorten


def refuse_unknown_parameters(request: Request) -> None:
    """Refuse a query parameter that the route does not know; ignored, it would silently select everything.

    Raises:
        ProblemError: a parameter is unknown; the message names the known ones.
    """
    route = request.scope["route"]
    if not isinstance(route, APIRoute):
        return
    known = sorted(_iterate_names(route.dependant))
    unknown = next((name for name in request.query_params if name not in known), None)
    if unknown is not None:
        names = f"known are {', '.join(known)}" if known else "this path has none"
        detail = f"query.{shorten(unknown)}: unknown parameter; {names}"
        raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)


def _iterate_names(dependant: Dependant) -> Iterator[str]:
    """Yield the query parameters of a route and of its dependencies."""
    yield from (field.alias for field in dependant.query_params)
    for dependency in dependant.dependencies:
        yield from _iterate_names(dependency)
