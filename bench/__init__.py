"""Runs tests, keeps their records, serves people."""

__all__: list[str] = []
