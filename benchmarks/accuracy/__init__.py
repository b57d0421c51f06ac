"""Benchmarks of accuracy: parameters, intervals, detection of effects."""

__all__: list[str] = []
