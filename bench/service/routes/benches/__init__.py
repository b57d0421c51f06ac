"""Routes of the benches: their list, and every part of a bench."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path

from bench.service.routes.benches import control, facts, listing

_PARTS = (control.router, facts.router)


def _name_bench(name: Annotated[str, Path(description="name of the bench", max_length=100)]) -> None:
    """Describe the name in the path; `AddressedBench` finds the bench."""


def _make_routers() -> tuple[APIRouter, APIRouter]:
    """Return the routes of the only bench, and the same ones of a named bench."""
    only, named = APIRouter(), APIRouter()
    for router in _PARTS:
        only.include_router(router, prefix="/bench")
        named.include_router(router, prefix="/benches/{name}", dependencies=[Depends(_name_bench)])
    return only, named


ROUTERS = (listing.router, *_make_routers())
"""All routers."""

__all__ = ["ROUTERS"]
