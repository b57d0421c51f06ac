"""A fixture that gives way, stiffens as it does so, and damps."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import STRETCH, STRETCH_RATE, Form, Place

LOSS = 2e-4
"""[s] damping over stiffness."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that the fixture carries."""
    bent = now[STRETCH] * (1.0 + (now[STRETCH] / values[1]) ** 2)
    return float((bent + LOSS * now[STRETCH_RATE]) / values[0])


def fastest(give: float, hardens: float) -> float:
    """Fastest rate [1/s]."""
    return 2.0 / LOSS


HARDENING_FIXTURE = Form(
    effect="fixture_compliance",
    form="hardening",
    stage="mounting",
    place=Place.CONNECTION,
    parameters=(
        Quantity("give", "m/N", 0.0, 1e-5, 1e-7, "what it gives way for each newton at first"),
        Quantity("hardens", "m", 1e-6, 1.0, 1e-4, "deflection at which its secant stiffness has doubled"),
    ),
    meaning="the fixture bends under the load",
    act=force,
    fastest=fastest,
)
