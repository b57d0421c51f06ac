"""A rod that is pressed sideways: dry friction that grows as the stroke leaves the middle."""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

CREEP = 1e-3
"""[m/s] below which the rod creeps rather than slides."""


def force(x: Any, velocity: Any, growth: Any, middle: Any) -> Any:
    """Force [N] beside the law at displacement x [m] and velocity [m/s]."""
    turn = velocity / np.sqrt(velocity * velocity + CREEP * CREEP)
    return growth * np.abs(x - middle) * turn


SIDE_LOAD_FRICTION = Effect(
    name="side_load_friction",
    stage="mounting",
    meaning="the rod is pressed sideways and rubs more towards the ends",
    forms=(
        Form(
            "linear",
            "parallel_force",
            (
                Quantity("growth", "N/m", 0.0, 1e5, 1000.0, "growth of the friction with the stroke"),
                Quantity("middle", "m", -0.1, 0.1, 5e-3, "where nothing presses"),
            ),
            ((0.0, 0.0), (0.0, -0.01), (0.0, 0.01)),
            force,
        ),
    ),
)
