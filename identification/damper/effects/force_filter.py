"""Unreported low-pass filter in the force channel: a first-order lag."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def make_lag(lag: Any) -> Any:
    """Return the time constant [s] of the channel."""
    return lag


FORCE_FILTER = Effect(
    name="force_filter",
    stage="force_channel",
    variable="force",
    meaning="the force channel is filtered more than its device reports",
    forms=(
        Form(
            "first_order",
            "force_lag",
            (Quantity("lag", "s", 0.0, 0.2, 2e-3, "time constant of the channel"),),
            ((1e-3,), (5e-3,)),
            make_lag,
        ),
    ),
)
