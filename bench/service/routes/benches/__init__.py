"""Routes of the benches: their list, and every part of a bench."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path
from fastapi.params import Depends as Dependency
from fastapi.routing import APIRoute

from bench.service.requests import IdempotentRoute
from bench.service.routes.benches import control, facts, listing


def _name_bench(name: Annotated[str, Path(description="name of the bench", max_length=100)]) -> None:
    """Describe the name in the path; `AddressedBench` finds the bench."""


def _make_router(prefix: str, *dependencies: Dependency) -> APIRouter:
    """Return all parts of a bench below a path.

    Each route is added by itself: the audit trail looks for the path of a route, which an included router hides.
    """
    router = APIRouter(prefix=prefix, tags=["bench"], route_class=IdempotentRoute, dependencies=list(dependencies))
    for route in (*control.router.routes, *facts.router.routes):
        if isinstance(route, APIRoute):
            router.add_api_route(
                route.path, route.endpoint, methods=list(route.methods or ()), dependencies=route.dependencies
            )
    return router


ROUTERS = (listing.router, _make_router("/bench"), _make_router("/benches/{name}", Depends(_name_bench)))
"""All routers."""

__all__ = ["ROUTERS"]
