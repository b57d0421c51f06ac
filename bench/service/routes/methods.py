"""Routes that list and return the included methods."""

from functools import cache

from fastapi import APIRouter

from bench.methods import Method, compile_method, list_checkpoints, list_shipped_methods, load_method
from bench.service.problems import make_not_found
from bench.service.views import MethodSummary

router = APIRouter(prefix="/methods", tags=["methods"])


@router.get("")
def list_methods() -> tuple[MethodSummary, ...]:
    """List the included methods with their summaries."""
    return _list_summaries()


@cache
def _list_summaries() -> tuple[MethodSummary, ...]:
    return tuple(_make_summary(load_method(name)) for name in list_shipped_methods())


def _make_summary(method: Method) -> MethodSummary:
    programme = compile_method(method)
    return MethodSummary(
        name=method.name,
        title=method.title,
        duration_s=programme.duration,
        checkpoints=list_checkpoints(programme),
        drive_kind=method.drive_kind,
    )


@router.get("/{name}", response_model_exclude_defaults=True)
def get_method(name: str) -> Method:
    """Return the document of one method."""
    return load_shipped_method(name)


def load_shipped_method(name: str) -> Method:
    """Load an included method; a name is never interpreted as a path.

    Raises:
        ProblemError: there is no method with this name.
    """
    if name not in list_shipped_methods():
        raise make_not_found("method", name)
    return load_method(name)
