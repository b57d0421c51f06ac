"""Limit matrix: thresholds for each limited quantity and each action.

There are two tiers: the limits of the specimen, from the method, and those of the fixture, from the bench's
configuration. For each quantity and action the stricter threshold applies.
"""

from collections.abc import Mapping
from enum import IntEnum
from typing import Literal, NamedTuple, TypeAlias, get_args

from bench.methods import Method

Quantity: TypeAlias = Literal[
    "force",
    "displacement",
    "actuator_velocity",
    "following_error",
    "coil_current",
    "coil_voltage",
    "temperature",
    "force_age",
    "setpoint_lateness",
]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
_DISPLAY_UNITS: dict[Quantity, tuple[float, str]] = {
    "force": (1.0, "N"),
    "displacement": (1e3, "mm"),
    "actuator_velocity": (1.0, "m/s"),
    "following_error": (1e3, "mm"),
    "coil_current": (1.0, "A"),
    "coil_voltage": (1.0, "V"),
    "temperature": (1.0, "°C"),
    "force_age": (1e3, "ms"),
    "setpoint_lateness": (1e3, "ms"),
}
"""Unit of each quantity in messages, with the factor that converts from SI to it."""
_LIMIT_MARGIN = 1.05
"""Factor on a method's limits of motion and drive (dimensionless): above it, the run is stopped.

Commands keep these limits exactly, but measured values also contain noise and overshoot."""
_TRIP_FACTOR = 1.25
"""Factor on a method's force limit (dimensionless): above it, the bench trips, because a stop is too slow."""


class Action(IntEnum):
    """Reaction to an exceeded limit, from the weakest to the strongest."""

    NONE = 0
    INDICATE = 1
    """Alarm in the log and on the page; the run continues."""
    HOLD = 2
    """The motion fades out, the coil goes to zero, and the rod is held at its position until a stop."""
    CONTROLLED_STOP = 3
    """The motion fades out, the coil goes to zero, and the run ends."""
    TRIP = 4
    """Coil and actuator are stopped at once, each in its fastest way; latches until a reset."""


Thresholds: TypeAlias = Mapping[Action, float]
"""Value beyond which each action is taken, in the quantity's unit."""
LimitMatrix: TypeAlias = Mapping[Quantity, Thresholds]


class LimitViolation(NamedTuple):
    """Exceeded limit; value and limit in the quantity's unit."""

    quantity: Quantity
    action: Action
    value: float
    limit: float

    def __str__(self) -> str:
        """Return a sentence with value, limit and unit."""
        factor, unit = _DISPLAY_UNITS[self.quantity]
        name = self.quantity.replace("_", " ")
        return f"{name} {factor * self.value:.4g} {unit} exceeds the limit of {factor * self.limit:.4g} {unit}"


def evaluate_limits(matrix: LimitMatrix, quantity: Quantity, value: float) -> LimitViolation | None:
    """Return the violation with the strongest action for a value of either sign, or None within the limits."""
    thresholds = matrix.get(quantity, {})
    exceeded = [action for action, limit in thresholds.items() if abs(value) > limit]
    if not exceeded:
        return None
    action = max(exceeded)
    return LimitViolation(quantity, action, value, thresholds[action])


def merge_limits(first: LimitMatrix, second: LimitMatrix) -> LimitMatrix:
    """Return the stricter of both thresholds for each quantity and action."""
    return {
        quantity: _merge_thresholds(first.get(quantity, {}), second.get(quantity, {}))
        for quantity in QUANTITIES
        if quantity in first or quantity in second
    }


def _merge_thresholds(first: Thresholds, second: Thresholds) -> Thresholds:
    return {
        action: min(thresholds[action] for thresholds in (first, second) if action in thresholds)
        for action in Action
        if action in first or action in second
    }


def make_specimen_matrix(method: Method) -> LimitMatrix:
    """Convert a method's own limits to the limit matrix that applies while it runs."""
    limits = method.limits
    drive: Quantity = "coil_current" if method.drive_kind == "coil_a" else "coil_voltage"
    return {
        "force": {Action.CONTROLLED_STOP: limits.force_n, Action.TRIP: _TRIP_FACTOR * limits.force_n},
        "displacement": {Action.CONTROLLED_STOP: _LIMIT_MARGIN * limits.stroke_m},
        "actuator_velocity": {Action.CONTROLLED_STOP: _LIMIT_MARGIN * limits.velocity_mps},
        drive: {Action.CONTROLLED_STOP: _LIMIT_MARGIN * limits.drive},
    }
