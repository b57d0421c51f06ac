"""The service's own error."""

from bench.errors import BenchError


class ServiceError(BenchError):
    """The service cannot be started."""
