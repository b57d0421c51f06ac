"""Comparison of recorded runs: cycles aligned by phase, conditions that differ, tolerance band of a reference."""

from bench.comparison.compare import RecordedRun, compare_runs
from bench.comparison.document import ComparedRun, Comparison, ComparisonRequest
from bench.comparison.series import ForceSeries, StrokeError, find_stroke_errors, read_force_series

__all__ = [
    "ComparedRun",
    "Comparison",
    "ComparisonRequest",
    "ForceSeries",
    "RecordedRun",
    "StrokeError",
    "compare_runs",
    "find_stroke_errors",
    "read_force_series",
]
