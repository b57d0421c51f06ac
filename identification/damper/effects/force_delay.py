"""A force channel that comes late: the force recorded at t is the one that acted at t - delay."""

from typing import Any

from identification.damper.effects.effect import Effect
from identification.damper.parameters import Quantity


def instant(time: Any, delay: Any) -> Any:
    """When the force that is recorded at ``time`` [s] acted [s]."""
    return time - delay


def slopes(time: Any, delay: Any) -> tuple[Any, Any]:
    """Slopes of that instant over time [1] and delay [1]."""
    return 0 * time + 1.0, 0 * time - 1.0


FORCE_DELAY = Effect(
    name="force_delay",
    stage="force_channel",
    acts="time_shift",
    form="pure_delay",
    parameters=(Quantity("delay", "s", 0.0, 0.05, 2e-3, "time by which the force channel lags"),),
    meaning="the load cell's filter or wire makes the force arrive late",
    act=instant,
    slopes=slopes,
)
