"""Shear thinning of the oil: at high shear rates the viscous part loses a share of its slope."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def scale_by_shear(x: Any, velocity: Any, loss: Any, speed: Any) -> Any:
    """Return factors [1] on alpha, c0 and c1 at a velocity [m/s]; the displacement [m] has no influence."""
    factor = 1.0 - loss * np.abs(velocity) / (np.abs(velocity) + speed)
    return factor**0, factor, factor**0


SHEAR_THINNING = Effect(
    name="shear_thinning",
    stage="damper",
    variable="velocity",
    meaning="the oil becomes thinner at speed",
    forms=(
        Form(
            "proportional",
            "scaling",
            (
                Quantity("loss", "1", 0.0, 0.95, 0.2, "share of the viscous slope lost at high speed"),
                Quantity("speed", "m/s", 5e-3, 2.0, 0.1, "speed at which half of that is lost"),
            ),
            ((0.0, 0.02), (0.0, 0.15)),
            scale_by_shear,
        ),
    ),
)
