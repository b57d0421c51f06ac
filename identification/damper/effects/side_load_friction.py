"""Side load on the rod: dry friction that grows with the distance from the middle of the stroke."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

CREEP_SPEED = 1e-3
"""Speed [m/s]: below it, the rod creeps rather than slides."""


def compute_side_friction(x: Any, velocity: Any, growth: Any, middle: Any) -> Any:
    """Return the parallel force [N] at displacement x [m] and a velocity [m/s]."""
    sign = velocity / np.sqrt(velocity * velocity + CREEP_SPEED * CREEP_SPEED)
    return growth * np.abs(x - middle) * sign


SIDE_LOAD_FRICTION = Effect(
    name="side_load_friction",
    stage="mounting",
    variable="displacement",
    meaning="a side load presses on the rod, which rubs more towards the ends of the stroke",
    forms=(
        Form(
            "linear",
            "parallel_force",
            (
                Quantity("growth", "N/m", 0.0, 1e5, 1000.0, "growth of the friction with the stroke"),
                Quantity("middle", "m", -0.1, 0.1, 5e-3, "displacement without side load"),
            ),
            ((0.0, 0.0), (0.0, -0.01), (0.0, 0.01)),
            compute_side_friction,
        ),
    ),
)
