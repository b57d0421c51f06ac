"""Checks between calibrations: records of checks from logs, and their control charts."""

from bench.checks.chart import (
    ChartPoint,
    CheckSeries,
    CheckValue,
    ControlChart,
    describe_latest,
    make_chart,
)
from bench.checks.control_chart import (
    BASELINE_POINTS,
    ChartLimits,
    ChartState,
    Rule,
    compute_chart,
    compute_ewma,
    compute_limits,
    find_rules,
)
from bench.checks.record import (
    CHECK_KINDS,
    CHECK_METHODS,
    CHECKED_CHANNELS,
    CheckKind,
    CheckRecord,
    compute_records,
    find_check_kind,
)
from bench.checks.statistics import (
    Difference,
    RestStatistics,
    TimedSamples,
    compute_difference,
    compute_statistics,
    estimate_correlation,
)

__all__ = [
    "BASELINE_POINTS",
    "CHECKED_CHANNELS",
    "CHECK_KINDS",
    "CHECK_METHODS",
    "ChartLimits",
    "ChartPoint",
    "ChartState",
    "CheckKind",
    "CheckRecord",
    "CheckSeries",
    "CheckValue",
    "ControlChart",
    "Difference",
    "RestStatistics",
    "Rule",
    "TimedSamples",
    "compute_chart",
    "compute_difference",
    "compute_ewma",
    "compute_limits",
    "compute_records",
    "compute_statistics",
    "describe_latest",
    "estimate_correlation",
    "find_check_kind",
    "find_rules",
    "make_chart",
]
