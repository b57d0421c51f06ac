"""Methods by name and version: those included in mrbench, and those stored in the catalogue."""

from dataclasses import dataclass
from datetime import datetime
from functools import cache

from bench.catalogue import SHIPPED_VERSION, MethodRow
from bench.methods import Method, compile_method, list_checkpoints, list_shipped_methods, load_method, parse_method
from bench.service.context import ServiceContext
from bench.service.problems import make_not_found


@dataclass(frozen=True)
class StoredMethod:
    """One version of a method."""

    method: Method
    version: int
    created: datetime | None
    """UTC; None for a method that is included in mrbench."""


@dataclass(frozen=True)
class MethodFacts:
    """Facts of a method that need its compilation."""

    duration: float
    """[s]"""
    checkpoints: tuple[str, ...]
    sha256: str


def list_methods(context: ServiceContext) -> list[StoredMethod]:
    """Return the newest version of each method, in the order of the names."""
    found = _load_shipped_methods() | {row.name: _read(row) for row in context.catalogue.methods.list_newest()}
    return [found[name] for name in sorted(found)]


@cache
def _load_shipped_methods() -> dict[str, StoredMethod]:
    return {name: StoredMethod(load_method(name), SHIPPED_VERSION, None) for name in list_shipped_methods()}


def find_method(context: ServiceContext, name: str, version: int | None = None) -> StoredMethod:
    """Return a version of a method, by default its newest; a name is never interpreted as a path.

    Raises:
        ProblemError: there is no such method, or no such version of it.
    """
    row = context.catalogue.methods.get(name, version)
    if row is not None:
        return _read(row)
    shipped = _load_shipped_methods().get(name)
    if shipped is not None and version in (None, SHIPPED_VERSION):
        return shipped
    raise make_not_found("method", name if version is None else f"{name} of version {version}")


def list_versions(context: ServiceContext, name: str) -> list[StoredMethod]:
    """Return the versions of a method, the newest first.

    Raises:
        ProblemError: there is no such method.
    """
    shipped = _load_shipped_methods().get(name)
    found = [_read(row) for row in context.catalogue.methods.list_versions(name)]
    found += [] if shipped is None else [shipped]
    if not found:
        raise make_not_found("method", name)
    return found


def _read(row: MethodRow) -> StoredMethod:
    return StoredMethod(parse_method(row.document, f"method {row.name}"), row.version, row.created)


def describe_facts(method: Method) -> MethodFacts:
    """Return duration, checkpoints and hash of a method; computed once for each content."""
    return _describe_document(method.to_json())


@cache
def _describe_document(document: str) -> MethodFacts:
    method = Method.model_validate_json(document)
    programme = compile_method(method)
    return MethodFacts(programme.duration, list_checkpoints(programme), method.compute_sha256())
