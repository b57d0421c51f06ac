"""Which quantity may be how large, and what is done where it is larger: a matrix of limits and actions.

There are two tiers: what the specimen bears, which the method says, and what the fixture bears, which the bench's
configuration says. The stricter of the two wins, action by action.
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
_READ: dict[Quantity, tuple[float, str]] = {
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
"""The unit in which a person reads each quantity, and how many of it the SI unit is."""
_SPARE = 1.05
"""A method keeps its limits of motion and drive exactly; what is measured of them carries noise and overshoot."""
_BEYOND = 1.25
"""Share of the method's force limit at which a stop in good order is not soon enough."""


class Action(IntEnum):
    """What is done, from nothing to the most."""

    NONE = 0
    INDICATE = 1
    """An alarm in the log and on the screen; the run goes on."""
    HOLD = 2
    """The motion fades out, the coil goes to zero, and the rod is held where it stands until a stop."""
    CONTROLLED_STOP = 3
    """The motion fades out, the coil goes to zero, and the run ends."""
    TRIP = 4
    """Coil and actuator are brought to rest at once, each by its own fastest way; latched."""


Steps: TypeAlias = Mapping[Action, float]
"""The value beyond which each action is taken, in the quantity's unit."""
Matrix: TypeAlias = Mapping[Quantity, Steps]


class Verdict(NamedTuple):
    """A limit that is exceeded."""

    quantity: Quantity
    action: Action
    value: float
    limit: float
    """Both in the quantity's unit."""

    def __str__(self) -> str:
        """For a person."""
        times, unit = _READ[self.quantity]
        name = self.quantity.replace("_", " ")
        return f"{name} {times * self.value:.4g} {unit} exceeds the limit of {times * self.limit:.4g} {unit}"


def judge(matrix: Matrix, quantity: Quantity, value: float) -> Verdict | None:
    """The strongest action that a value [in the quantity's unit, either sign] asks for, if any."""
    steps = matrix.get(quantity, {})
    exceeded = [action for action, limit in steps.items() if abs(value) > limit]
    if not exceeded:
        return None
    action = max(exceeded)
    return Verdict(quantity, action, value, steps[action])


def stricter(first: Matrix, second: Matrix) -> Matrix:
    """Both tiers as one."""
    return {
        quantity: _stricter_steps(first.get(quantity, {}), second.get(quantity, {}))
        for quantity in QUANTITIES
        if quantity in first or quantity in second
    }


def _stricter_steps(first: Steps, second: Steps) -> Steps:
    return {
        action: min(steps[action] for steps in (first, second) if action in steps)
        for action in Action
        if action in first or action in second
    }


def specimen_matrix(method: Method) -> Matrix:
    """What a method's own limits mean while it runs."""
    limits = method.limits
    drive: Quantity = "coil_current" if method.drive_kind == "coil_a" else "coil_voltage"
    return {
        "force": {Action.CONTROLLED_STOP: limits.force_n, Action.TRIP: _BEYOND * limits.force_n},
        "displacement": {Action.CONTROLLED_STOP: _SPARE * limits.stroke_m},
        "actuator_velocity": {Action.CONTROLLED_STOP: _SPARE * limits.velocity_mps},
        drive: {Action.CONTROLLED_STOP: _SPARE * limits.drive},
    }
