"""Benchmarks of speed and accuracy, printed as ratios to a baseline of the same run; no test depends on them."""

__all__: list[str] = []
