"""Errors of the log store."""

from bench.errors import LogError


class LogStoreError(LogError):
    """The address of a log store is not valid, or an object in it is missing or has another content."""


class LogStoreUnavailableError(LogStoreError):
    """A log store cannot be reached at present, or refuses access."""
