"""Errors of the client."""

from bench.errors import BenchError


class ClientError(BenchError):
    """The service refused a request, or it cannot be reached.

    Args:
        message: what failed and what to do.
        status: HTTP status; None if there was no reply.
        kind: ``type`` of the problem, such as ``urn:mrbench:problem:not-found``; empty if there was none.
    """

    def __init__(self, message: str, status: int | None = None, kind: str = "") -> None:
        super().__init__(message)
        self.status, self.kind = status, kind
