"""Limits, interlocks and the stop of the bench."""

from bench.safety.interlocks import Interlocks, Trip, compute_following_error
from bench.safety.limits import Action, LimitMatrix, LimitViolation, Quantity, make_specimen_matrix
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
    "make_specimen_matrix",
]
