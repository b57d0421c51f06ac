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
    CHECK_METHODS,
    CHECKED_CHANNELS,
    CheckKind,
    CheckRecord,
    compute_records,
)
from bench.checks.statistics import RestStatistics, compute_statistics, estimate_correlation

__all__ = [
    "BASELINE_POINTS",
    "CHECKED_CHANNELS",
    "CHECK_METHODS",
    "ChartLimits",
    "ChartPoint",
    "ChartState",
    "CheckKind",
    "CheckRecord",
    "CheckSeries",
    "CheckValue",
    "ControlChart",
    "RestStatistics",
    "Rule",
    "compute_chart",
    "compute_ewma",
    "compute_limits",
    "compute_records",
    "compute_statistics",
    "describe_latest",
    "estimate_correlation",
    "find_rules",
    "make_chart",
]
