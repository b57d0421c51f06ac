"""Error of the catalogue."""

from bench.errors import BenchError


class CatalogueError(BenchError):
    """The catalogue cannot be opened or has a later version."""
