"""How a job can end otherwise than done."""

from bench.errors import BenchError


class JobError(BenchError):
    """The work could not be done; the message says why."""


class JobCancelledError(BenchError):
    """Somebody has asked for its end."""


class WorkerError(BenchError):
    """A worker or a scheduler cannot be reached or started."""
