"""A displacement channel that comes late: the displacement recorded at t was there at t - delay."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def late(delay: Any) -> Any:
    """Time [s] by which the channel is late."""
    return delay


DISPLACEMENT_DELAY = Effect(
    name="displacement_delay",
    stage="displacement_channel",
    meaning="the displacement channel arrives late",
    forms=(
        Form(
            "pure_delay",
            "displacement_shift",
            (Quantity("delay", "s", 0.0, 0.05, 2e-3, "time by which the displacement channel lags"),),
            ((0.0,), (3e-3,)),
            late,
        ),
    ),
)
