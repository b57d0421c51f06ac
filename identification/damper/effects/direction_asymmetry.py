"""Different resistance in extension and compression: valves, a check disc, an uneven gap.

- ``proportional``: yield and viscous parts grow by a share in extension and shrink by it in compression, at any
  drive.
- ``one_sided``: an additional force that is independent of the drive resists one direction only.

Shares and forces may have either sign.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def scale_by_direction(x: Any, velocity: Any, yielding: Any, viscous: Any, width: Any) -> Any:
    """Return factors [1] on alpha, c0 and c1 at a velocity [m/s]; the displacement [m] has no influence."""
    direction = velocity / np.sqrt(velocity * velocity + width * width)
    return 1.0 + yielding * direction, 1.0 + viscous * direction, 1.0 + viscous * direction


def compute_one_sided_force(x: Any, velocity: Any, damping: Any, friction: Any, width: Any) -> Any:
    """Return a parallel force [N], even in the velocity: it adds in one direction and subtracts in the other."""
    speed = np.sqrt(velocity * velocity + width * width)
    return damping * (speed - width) + friction * (velocity / speed) ** 2


_WIDTH = Quantity("width", "m/s", 1e-3, 0.1, 0.01, "width in velocity of the transition between the directions")

DIRECTION_ASYMMETRY = Effect(
    name="direction_asymmetry",
    stage="damper",
    variable="velocity",
    meaning="the damper resists one direction more than the other",
    forms=(
        Form(
            "proportional",
            "scaling",
            (
                Quantity("yield_share", "1", -0.8, 0.8, 0.05, "growth of the yield force in extension"),
                Quantity("viscous_share", "1", -0.8, 0.8, 0.05, "growth of the viscous force in extension"),
                _WIDTH,
            ),
            ((0.0, 0.0, 0.003), (0.0, 0.0, 0.02)),
            scale_by_direction,
        ),
        Form(
            "one_sided",
            "parallel_force",
            (
                Quantity("damping", "N s/m", -2e4, 2e4, 100.0, "viscous force of extension over compression"),
                Quantity("friction", "N", -1000.0, 1000.0, 10.0, "dry force of extension over compression"),
                _WIDTH,
            ),
            ((0.0, 0.0, 0.003), (0.0, 0.0, 0.02)),
            compute_one_sided_force,
        ),
    ),
)
