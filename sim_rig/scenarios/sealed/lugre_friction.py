"""Friction of the seal by bristles that bend before they slip (LuGre); its peak falls after Hess and Soom."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V

STIR = 2e-5
"""[s] bristle damping over bristle stiffness: small enough to stay passive."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]; the memory is the bend of the bristles over the pre-sliding distance [1]."""
    v, bend = now[V], values[2]
    strength = 1.0 + values[1] / (1.0 + (v / values[3]) ** 2)
    rate[0] = (v - abs(v) * memory[0] / strength) / bend
    return float(values[0] * (memory[0] + STIR * rate[0]))


def fastest(sliding: float, peak: float, bend: float, stribeck: float) -> float:
    """Fastest rate [1/s], at 0.5 m/s."""
    return 0.5 / bend


LUGRE_FRICTION = Form(
    effect="seal_friction",
    form="lugre",
    stage="damper",
    place=Place.PARALLEL,
    parameters=(
        Quantity("sliding", "N", 0.0, 2000.0, 15.0, "friction while sliding"),
        Quantity("peak", "1", 0.0, 3.0, 0.7, "what sticking adds, as a part of it"),
        Quantity("bend", "m", 5e-6, 1e-3, 5e-5, "pre-sliding distance"),
        Quantity("stribeck", "m/s", 1e-3, 0.2, 0.02, "velocity at which the peak fades"),
    ),
    meaning="the seals stick and rub",
    act=force,
    fastest=fastest,
)
