"""Benchmarks: ratios against a baseline measured in the same run. They print; they never decide a test."""

__all__: list[str] = []
