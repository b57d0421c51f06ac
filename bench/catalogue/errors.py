"""Errors of the catalogue."""

from bench.errors import BenchError


class CatalogueError(BenchError):
    """The catalogue cannot be opened or has a later version."""


class CatalogueUnavailableError(CatalogueError):
    """The database of an open catalogue cannot be reached, read or written at present."""
