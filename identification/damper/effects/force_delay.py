"""Delay of the force channel: the force recorded at t acted at t - delay."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def make_delay(delay: Any) -> Any:
    """Return the delay [s] of the channel."""
    return delay


FORCE_DELAY = Effect(
    name="force_delay",
    stage="force_channel",
    variable="force",
    meaning="the load cell's filter or wire delays the force",
    forms=(
        Form(
            "pure_delay",
            "time_shift",
            (Quantity("delay", "s", 0.0, 0.05, 2e-3, "delay of the force channel"),),
            ((0.0,), (3e-3,)),
            make_delay,
        ),
    ),
)
