"""Dry friction of the rod seal: a static peak that falls to the sliding value (Stribeck).

force = (F_c + F_s exp(-(v/v_s)^2)) v / sqrt(v^2 + v_0^2): the last factor is a sign without a jump.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect
from identification.damper.parameters import Quantity

CREEP = 5e-4
"""[m/s] v_0, below which the seal creeps rather than slides."""


def force(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> Any:
    """Force [N] beside the law at velocity [m/s]; the displacement [m] plays no part."""
    turn = velocity / (velocity * velocity + CREEP * CREEP) ** 0.5
    return (sliding + peak * np.exp(-((velocity / stribeck) ** 2))) * turn


def slopes(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Slopes of the force over x [N/m], velocity [N s/m], sliding [1], peak [1], stribeck [N s/m]."""
    fast = velocity * velocity + CREEP * CREEP
    turn = velocity / fast**0.5
    bell = np.exp(-((velocity / stribeck) ** 2))
    narrow = 2 * peak * bell * velocity / stribeck**2
    over_velocity = (sliding + peak * bell) * CREEP * CREEP / fast**1.5 - narrow * turn
    return 0 * x, over_velocity, turn, bell * turn, narrow * velocity / stribeck * turn


SEAL_FRICTION = Effect(
    name="seal_friction",
    stage="damper",
    acts="parallel_force",
    form="stribeck",
    parameters=(
        Quantity("sliding", "N", 0.0, 1000.0, 20.0, "friction while sliding"),
        Quantity("peak", "N", 0.0, 1000.0, 10.0, "what sticking adds to it"),
        Quantity("stribeck", "m/s", 5e-4, 0.2, 0.015, "velocity at which the peak has gone"),
    ),
    meaning="the seals rub, and stick before they slide",
    act=force,
    slopes=slopes,
)
