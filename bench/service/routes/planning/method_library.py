"""Methods by name and version for the routes, and facts that need the compilation of a method."""

from dataclasses import dataclass
from functools import cache

from bench.catalogue import StoredMethod
from bench.methods import Method, compile_method, list_checkpoints
from bench.service.context import ServiceContext
from bench.service.problems import make_not_found


@dataclass(frozen=True)
class MethodFacts:
    """Facts of a method that need its compilation."""

    duration: float
    """[s]"""
    checkpoints: tuple[str, ...]
    sha256: str


def find_method(context: ServiceContext, name: str, version: int | None = None) -> StoredMethod:
    """Return a version of a method, by default its newest; a name is never interpreted as a path.

    Raises:
        ProblemError: there is no such method, or no such version of it.
    """
    found = context.catalogue.method_library.find(name, version)
    if found is None:
        raise make_not_found("method", name if version is None else f"{name} of version {version}")
    return found


def list_versions(context: ServiceContext, name: str) -> list[StoredMethod]:
    """Return the versions of a method, the newest first.

    Raises:
        ProblemError: there is no such method.
    """
    found = context.catalogue.method_library.list_versions(name)
    if not found:
        raise make_not_found("method", name)
    return found


def describe_facts(method: Method) -> MethodFacts:
    """Return duration, checkpoints and hash of a method; computed once for each content."""
    return _describe_document(method.to_json())


@cache
def _describe_document(document: str) -> MethodFacts:
    method = Method.model_validate_json(document)
    programme = compile_method(method)
    return MethodFacts(programme.duration, list_checkpoints(programme), method.compute_sha256())
