"""Dry friction of the rod seal: a static peak that falls to the sliding value (Stribeck).

force = (F_c + F_s exp(-(v/v_s)^2)) v / sqrt(v^2 + v_0^2): the last factor is a sign without a jump. Where the peak
falls more gently than a bell, the second form fits better. A soft lip bends before it slides (Dahl): then the sign
is what the lip remembers of the way since the last reversal.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

CREEP = 5e-4
"""[m/s] v_0, below which the seal creeps rather than slides."""


def bell(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> Any:
    """Force [N] beside the law at velocity [m/s]; the displacement [m] plays no part."""
    turn = velocity / np.sqrt(velocity * velocity + CREEP * CREEP)
    return (sliding + peak * np.exp(-((velocity / stribeck) ** 2))) * turn


def gentle(x: Any, velocity: Any, sliding: Any, peak: Any, stribeck: Any) -> Any:
    """The same with a peak that falls as a simple exponential of the speed."""
    turn = velocity / np.sqrt(velocity * velocity + CREEP * CREEP)
    return (sliding + peak * np.exp(-np.abs(velocity) / stribeck)) * turn


def bending(x: Any, velocity: Any, bent: Any, sliding: Any, peak: Any, stribeck: Any, bend: Any) -> Any:
    """The same of a lip that is bent by a part [1] of what it can be."""
    return (sliding + peak * np.exp(-((velocity / stribeck) ** 2))) * bent


def bent_after(bent: Any, change: Any, sliding: Any, peak: Any, stribeck: Any, bend: Any) -> Any:
    """Part [1] by which the lip is bent after a change of the displacement [m] in one sense."""
    target = 1.0 if change > 0.0 else -1.0
    return target + (bent - target) * np.exp(-abs(change) / bend)


_PARAMETERS = (
    Quantity("sliding", "N", 0.0, 1000.0, 20.0, "friction while sliding"),
    Quantity("peak", "N", 0.0, 1000.0, 10.0, "what sticking adds to it"),
    Quantity("stribeck", "m/s", 5e-4, 0.2, 0.015, "velocity at which the peak has gone"),
)
_STARTS = ((0.0, 0.0, 0.006), (0.0, 0.0, 0.02), (0.0, 0.0, 0.06))

SEAL_FRICTION = Effect(
    name="seal_friction",
    stage="damper",
    meaning="the seals rub, and stick before they slide",
    forms=(
        Form("stribeck", "parallel_force", _PARAMETERS, _STARTS, bell),
        Form("stribeck_gentle", "parallel_force", _PARAMETERS, _STARTS, gentle),
        Form(
            "bending_lip",
            "dragging_force",
            (*_PARAMETERS, Quantity("bend", "m", 2e-6, 2e-3, 5e-5, "way over which the lip bends")),
            tuple((*start, bend) for start in _STARTS for bend in (3e-5, 2e-4)),
            bending,
            bent_after,
        ),
    ),
)
