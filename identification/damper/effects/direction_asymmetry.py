"""A damper that is not the same in both directions: valves, a check disc, an uneven gap.

Either yield and viscous parts grow by a share in extension and shrink by it in compression, whatever the drive;
or something beside the law, which the drive does not reach, resists one direction only. Shares of either sign.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def shares(x: Any, velocity: Any, yielding: Any, viscous: Any, width: Any) -> Any:
    """Factors [1] of alpha, c0 and c1 at velocity [m/s]; the displacement [m] plays no part."""
    way = velocity / np.sqrt(velocity * velocity + width * width)
    return 1.0 + yielding * way, 1.0 + viscous * way, 1.0 + viscous * way


def one_way(x: Any, velocity: Any, damping: Any, friction: Any, width: Any) -> Any:
    """Force [N] beside the law, even in the velocity: adds to one direction what it takes from the other."""
    speed = np.sqrt(velocity * velocity + width * width)
    return damping * (speed - width) + friction * (velocity / speed) ** 2


_WIDTH = Quantity("width", "m/s", 1e-3, 0.1, 0.01, "velocity over which one direction turns into the other")

DIRECTION_ASYMMETRY = Effect(
    name="direction_asymmetry",
    stage="damper",
    meaning="the damper resists one direction more than the other",
    forms=(
        Form(
            "shares",
            "scaling",
            (
                Quantity("yield_share", "1", -0.8, 0.8, 0.05, "growth of the yield force in extension"),
                Quantity("viscous_share", "1", -0.8, 0.8, 0.05, "growth of the viscous force in extension"),
                _WIDTH,
            ),
            ((0.0, 0.0, 0.003), (0.0, 0.0, 0.02)),
            shares,
        ),
        Form(
            "one_way",
            "parallel_force",
            (
                Quantity("damping", "N s/m", -2e4, 2e4, 100.0, "viscous force of extension over compression"),
                Quantity("friction", "N", -1000.0, 1000.0, 10.0, "dry force of extension over compression"),
                _WIDTH,
            ),
            ((0.0, 0.0, 0.003), (0.0, 0.0, 0.02)),
            one_way,
        ),
    ),
)
