"""Oil that gets thinner when it is sheared fast: the viscous part loses a share of its slope."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def thinned(x: Any, velocity: Any, loss: Any, speed: Any) -> Any:
    """Factors [1] of alpha, c0 and c1 at velocity [m/s]; the displacement [m] plays no part."""
    left = 1.0 - loss * np.abs(velocity) / (np.abs(velocity) + speed)
    return left**0, left, left**0


SHEAR_THINNING = Effect(
    name="shear_thinning",
    stage="damper",
    meaning="the oil gets thinner at speed",
    forms=(
        Form(
            "shares",
            "scaling",
            (
                Quantity("loss", "1", 0.0, 0.95, 0.2, "share of the viscous slope lost at high speed"),
                Quantity("speed", "m/s", 5e-3, 2.0, 0.1, "at which half of that is lost"),
            ),
            ((0.0, 0.02), (0.0, 0.15)),
            thinned,
        ),
    ),
)
