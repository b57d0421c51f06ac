"""A bolted joint that gives way until its gaps close: soft at first, three times as stiff in the end, damped."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import STRETCH, STRETCH_RATE, Form, Place

LOSS = 5e-4
"""[s] damping over the stiffness at first."""
CLOSED = 2.0
"""[1] what the closed joint is stiffer, over the stiffness at first."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that the joint carries."""
    closed = now[STRETCH] ** 2 / (now[STRETCH] ** 2 + values[1] ** 2)
    return float((now[STRETCH] * (1.0 + CLOSED * closed) + LOSS * now[STRETCH_RATE]) / values[0])


def fastest(give: float, closes: float) -> float:
    """Fastest rate [1/s]."""
    return (1.0 + 1.5 * CLOSED) / LOSS


CLOSING_JOINT = Form(
    effect="fixture_compliance",
    form="closing_joint",
    stage="mounting",
    place=Place.CONNECTION,
    parameters=(
        Quantity("give", "m/N", 0.0, 1e-5, 1e-7, "what it gives way for each newton at first"),
        Quantity("closes", "m", 1e-6, 1.0, 1e-4, "deflection at which half of its gaps have closed"),
    ),
    meaning="the fixture bends under the load",
    act=force,
    fastest=fastest,
)
