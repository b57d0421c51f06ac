"""The methods that ship with the product."""

from functools import cache

from fastapi import APIRouter

from bench.methods import Method, compile_method, load_method, shipped_methods
from bench.service.problems import not_found
from bench.service.views import MethodSummary

router = APIRouter(prefix="/methods", tags=["methods"])


@router.get("")
def methods() -> tuple[MethodSummary, ...]:
    """All of them, in short."""
    return _summaries()


@cache
def _summaries() -> tuple[MethodSummary, ...]:
    return tuple(_summary(load_method(name)) for name in shipped_methods())


def _summary(method: Method) -> MethodSummary:
    return MethodSummary(
        name=method.name,
        title=method.title,
        duration_s=compile_method(method).duration,
        drive_kind=method.drive_kind,
    )


@router.get("/{name}", response_model_exclude_defaults=True)
def method(name: str) -> Method:
    """One of them, as its document."""
    return shipped(name)


def shipped(name: str) -> Method:
    """A shipped method; a name is never taken for a file.

    Raises:
        ProblemError: there is none of that name.
    """
    if name not in shipped_methods():
        raise not_found("method", name)
    return load_method(name)
