"""Delay of the displacement channel: the displacement recorded at t occurred at t - delay."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def make_delay(delay: Any) -> Any:
    """Return the delay [s] of the channel."""
    return delay


DISPLACEMENT_DELAY = Effect(
    name="displacement_delay",
    stage="displacement_channel",
    variable="velocity",
    meaning="the displacement channel arrives late",
    forms=(
        Form(
            "pure_delay",
            "displacement_shift",
            (Quantity("delay", "s", 0.0, 0.05, 2e-3, "delay of the displacement channel"),),
            ((0.0,), (3e-3,)),
            make_delay,
        ),
    ),
)
