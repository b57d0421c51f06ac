"""Measures of test quality, and comparison of the documents of two versions."""

__all__: list[str] = []
