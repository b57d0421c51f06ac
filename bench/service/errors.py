"""Error of the service."""

from bench.errors import BenchError


class ServiceError(BenchError):
    """The service cannot be started."""
