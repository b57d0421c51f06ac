"""Errors of jobs and workers."""

from bench.errors import BenchError


class JobError(BenchError):
    """A job failed; the message gives the reason."""


class JobCancelledError(BenchError):
    """A job was cancelled."""


class WorkerError(BenchError):
    """A worker or a scheduler cannot be reached or started."""
