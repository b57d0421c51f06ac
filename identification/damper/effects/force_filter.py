"""A low-pass in the force channel of which the device says nothing: a first-order lag."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def slow(lag: Any) -> Any:
    """Time constant [s] of the channel."""
    return lag


FORCE_FILTER = Effect(
    name="force_filter",
    stage="force_channel",
    meaning="the force channel is smoothed by more than it says",
    forms=(
        Form(
            "first_order",
            "force_lag",
            (Quantity("lag", "s", 0.0, 0.2, 2e-3, "time constant of the channel"),),
            ((1e-3,), (5e-3,)),
            slow,
        ),
    ),
)
