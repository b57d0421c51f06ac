"""A coil whose field comes later or more slowly than one first-order lag: eddy currents, a driver's own delay.

Where the iron is solid, only the part of the field that stands deep in it comes slowly; from very deep it has to
come through two layers.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def slow(lag: Any) -> Any:
    """Dead time [s], time constant of a second lag [s], part of the field behind it [1], and lags in a row [1]."""
    return 0.0 * lag, lag, 1.0, 1


def late(delay: Any) -> Any:
    """The same for a dead time alone."""
    return delay, 0.0 * delay, 1.0, 1


def late_and_slow(delay: Any, lag: Any) -> Any:
    """The same for both."""
    return delay, lag, 1.0, 1


def partly_slow(lag: Any, part: Any) -> Any:
    """The same where a part of the field comes slowly."""
    return 0.0 * lag, lag, part, 1


def deeply_slow(lag: Any, part: Any) -> Any:
    """The same where it has to come through two layers of iron."""
    return 0.0 * lag, lag, part, 2


_DELAY = Quantity("delay", "s", 0.0, 0.2, 5e-3, "dead time between drive and field")
_LAG = Quantity("lag", "s", 0.0, 1.0, 5e-3, "time constant of a second lag")

_SLOW = Quantity("lag", "s", 1e-3, 1.0, 0.03, "time constant of the slow part")
_PART = Quantity("part", "1", 0.0, 1.0, 0.3, "of the field that comes slowly")

COIL_LAG = Effect(
    name="coil_lag",
    stage="coil",
    meaning="the field follows the drive later or more slowly than one simple lag",
    forms=(
        Form("second_lag", "drive_delay", (_LAG,), ((2e-3,), (1.5e-2,)), slow),
        Form("dead_time", "drive_delay", (_DELAY,), ((0.0,), (1e-2,)), late),
        Form("late_and_slow", "drive_delay", (_DELAY, _LAG), ((2e-3, 4e-3), (1e-2, 1.5e-2)), late_and_slow),
        Form("partly_slow", "drive_delay", (_SLOW, _PART), ((0.01, 0.0), (0.04, 0.0), (0.15, 0.0)), partly_slow),
        Form("deeply_slow", "drive_delay", (_SLOW, _PART), ((0.01, 0.0), (0.03, 0.0), (0.1, 0.0)), deeply_slow),
    ),
)
