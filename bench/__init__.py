"""Test bench: runs, logs, catalogue, jobs, and the service with its web page."""

__all__: list[str] = []
