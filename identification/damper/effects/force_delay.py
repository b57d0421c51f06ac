"""A force channel that comes late: the force recorded at t is the one that acted at t - delay."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def late(delay: Any) -> Any:
    """Time [s] by which the channel is late."""
    return delay


FORCE_DELAY = Effect(
    name="force_delay",
    stage="force_channel",
    meaning="the load cell's filter or wire makes the force arrive late",
    forms=(
        Form(
            "pure_delay",
            "time_shift",
            (Quantity("delay", "s", 0.0, 0.05, 2e-3, "time by which the force channel lags"),),
            ((0.0,), (3e-3,)),
            late,
        ),
    ),
)
