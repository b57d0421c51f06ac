"""Limits, interlocks and the stop of the bench."""

from bench.safety.interlocks import Interlocks, Trip, compute_following_error
from bench.safety.limits import (
    Action,
    LimitMatrix,
    LimitViolation,
    Quantity,
    evaluate_limits,
    make_specimen_matrix,
    merge_limits,
)
from bench.safety.trip import STOP_DEADLINE, bring_to_rest

__all__ = [
    "STOP_DEADLINE",
    "Action",
    "Interlocks",
    "LimitMatrix",
    "LimitViolation",
    "Quantity",
    "Trip",
    "bring_to_rest",
    "compute_following_error",
    "evaluate_limits",
    "make_specimen_matrix",
    "merge_limits",
]
