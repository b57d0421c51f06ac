"""Methods by name and version: those included in mrbench, and those stored in the catalogue."""

from dataclasses import dataclass
from datetime import datetime
from functools import cache

from bench.catalogue.planning.methods import SHIPPED_VERSION, MethodRow, MethodStore
from bench.methods import Method, list_shipped_methods, load_method, parse_method


@dataclass(frozen=True)
class StoredMethod:
    """One version of a method."""

    method: Method
    version: int
    created: datetime | None
    """UTC; None for a method that is included in mrbench."""


class MethodLibrary:
    """All methods of a catalogue; a name is never interpreted as a path."""

    def __init__(self, store: MethodStore) -> None:
        """Use the stored methods of a catalogue."""
        self._store = store

    def list_newest(self) -> list[StoredMethod]:
        """Return the newest version of each method, in the order of the names.

        Raises:
            MethodError: a stored document is invalid.
        """
        found = _load_shipped_methods() | {row.name: _read(row) for row in self._store.list_newest()}
        return [found[name] for name in sorted(found)]

    def find(self, name: str, version: int | None = None) -> StoredMethod | None:
        """Return a version of a method, by default its newest; None if there is no such version.

        Raises:
            MethodError: the stored document is invalid.
        """
        row = self._store.get(name, version)
        if row is not None:
            return _read(row)
        return _load_shipped_methods().get(name) if version in (None, SHIPPED_VERSION) else None

    def list_versions(self, name: str) -> list[StoredMethod]:
        """Return the versions of a method, the newest first; none for an unknown name.

        Raises:
            MethodError: a stored document is invalid.
        """
        shipped = _load_shipped_methods().get(name)
        stored = [_read(row) for row in self._store.list_versions(name)]
        return [*stored, *([] if shipped is None else [shipped])]


@cache
def _load_shipped_methods() -> dict[str, StoredMethod]:
    return {name: StoredMethod(load_method(name), SHIPPED_VERSION, None) for name in list_shipped_methods()}


def _read(row: MethodRow) -> StoredMethod:
    return StoredMethod(parse_method(row.document, f"method {row.name}"), row.version, row.created)
