"""The catalogue's own error."""

from bench.errors import BenchError


class CatalogueError(BenchError):
    """The catalogue cannot be opened, or is of another version."""
