"""Side load on the rod: dry friction that grows with the distance from the middle of the stroke.

With ``linear`` the rod slides at once. With ``bristle`` the guide deflects before it slides, and sticks more than
it slides, as the seal does in the LuGre model (see `seal_friction`).
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.effects.seal_friction import (
    PEAK_RATIO,
    PRESLIDING_DISTANCE,
    STRIBECK_SPEED,
    update_bristle_deflection,
)
from identification.damper.parameters import Quantity

CREEP_SPEED = 1e-3
"""Speed [m/s]: below it, the rod creeps rather than slides."""


def compute_side_friction(x: Any, velocity: Any, growth: Any, middle: Any) -> Any:
    """Return the parallel force [N] at displacement x [m] and a velocity [m/s]."""
    sign = velocity / np.sqrt(velocity * velocity + CREEP_SPEED * CREEP_SPEED)
    return growth * np.abs(x - middle) * sign


def compute_bristle_side_friction(
    x: Any,
    velocity: Any,
    deflection: Any,
    growth: Any,
    middle: Any,
    peak_ratio: Any,
    stribeck: Any,
    presliding_distance: Any,
) -> Any:
    """Return the parallel force [N] of a guide with a deflection [1], relative to that of fast sliding."""
    return growth * np.abs(x - middle) * deflection


_GROWTH = Quantity("growth", "N/m", 0.0, 1e5, 1000.0, "growth of the friction with the stroke")
_MIDDLE = Quantity("middle", "m", -0.1, 0.1, 5e-3, "displacement without side load")
_MIDDLES = (0.0, -0.01, 0.01)

SIDE_LOAD_FRICTION = Effect(
    name="side_load_friction",
    stage="mounting",
    variable="displacement",
    meaning="a side load presses on the rod, which rubs more towards the ends of the stroke",
    forms=(
        Form(
            "linear",
            "parallel_force",
            (_GROWTH, _MIDDLE),
            tuple((0.0, middle) for middle in _MIDDLES),
            compute_side_friction,
        ),
        Form(
            "bristle",
            "hysteretic_force",
            (_GROWTH, _MIDDLE, PEAK_RATIO, STRIBECK_SPEED, PRESLIDING_DISTANCE),
            tuple((0.0, middle, 0.3, 0.006, 3e-5) for middle in _MIDDLES),
            compute_bristle_side_friction,
            update_bristle_deflection,
        ),
    ),
)
