"""Field that follows the drive later or more slowly than one first-order lag: eddy currents, delay of the driver.

In solid iron only the field deep inside is slow (``partial_lag``). The deepest part of it passes two layers of
iron (``two_layer_lag``).
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def make_second_lag(lag: Any) -> Any:
    """Return dead time [s], second lag [s], fraction of the field behind it [1] and number of lags [1]."""
    return 0.0 * lag, lag, 1.0, 1


def make_dead_time(delay: Any) -> Any:
    """Return the same four numbers for a dead time alone."""
    return delay, 0.0 * delay, 1.0, 1


def make_dead_time_and_lag(delay: Any, lag: Any) -> Any:
    """Return the same four numbers for a dead time and a second lag."""
    return delay, lag, 1.0, 1


def make_partial_lag(lag: Any, slow_fraction: Any) -> Any:
    """Return the same four numbers for a fraction of the field behind a second lag."""
    return 0.0 * lag, lag, slow_fraction, 1


def make_two_layer_lag(lag: Any, slow_fraction: Any) -> Any:
    """Return the same four numbers for a fraction of the field behind two layers of iron."""
    return 0.0 * lag, lag, slow_fraction, 2


_DELAY = Quantity("delay", "s", 0.0, 0.2, 5e-3, "dead time between drive and field")
_LAG = Quantity("lag", "s", 0.0, 1.0, 5e-3, "time constant of a second lag")

_PARTIAL_LAG = Quantity("lag", "s", 1e-3, 1.0, 0.03, "time constant of the slow fraction")
_SLOW_FRACTION = Quantity("slow_fraction", "1", 0.0, 1.0, 0.3, "fraction of the field that is slow")

COIL_LAG = Effect(
    name="coil_lag",
    stage="coil",
    variable="drive_history",
    meaning="the field follows the drive later or more slowly than one first-order lag",
    forms=(
        Form("second_lag", "drive_delay", (_LAG,), ((2e-3,), (1.5e-2,)), make_second_lag),
        Form("dead_time", "drive_delay", (_DELAY,), ((0.0,), (1e-2,)), make_dead_time),
        Form(
            "dead_time_and_lag",
            "drive_delay",
            (_DELAY, _LAG),
            ((2e-3, 4e-3), (1e-2, 1.5e-2)),
            make_dead_time_and_lag,
        ),
        Form(
            "partial_lag",
            "drive_delay",
            (_PARTIAL_LAG, _SLOW_FRACTION),
            ((0.01, 0.0), (0.04, 0.0), (0.15, 0.0)),
            make_partial_lag,
        ),
        Form(
            "two_layer_lag",
            "drive_delay",
            (_PARTIAL_LAG, _SLOW_FRACTION),
            ((0.01, 0.0), (0.03, 0.0), (0.1, 0.0)),
            make_two_layer_lag,
        ),
    ),
)
