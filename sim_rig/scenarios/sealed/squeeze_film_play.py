"""Play in the clevis with grease in it: the film drags while the pin crosses, and the contact is elastic."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import STRETCH, STRETCH_RATE, Form, Place

STIFFNESS = 1e8
"""[N/m] of the pin in contact."""
DAMPING = 1e4
"""[N s/m] of the contact."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that the pin carries."""
    half = 0.5 * values[0]
    pressed = now[STRETCH] - min(max(now[STRETCH], -half), half)
    carried = values[1] * now[STRETCH_RATE]
    if pressed != 0.0 or half == 0.0:
        carried += STIFFNESS * pressed + DAMPING * now[STRETCH_RATE]
    return float(carried)


def fastest(gap: float, film: float) -> float:
    """Fastest rate [1/s]: the contact's own."""
    return STIFFNESS / DAMPING


SQUEEZE_FILM_PLAY = Form(
    effect="clevis_backlash",
    form="squeeze_film",
    stage="mounting",
    place=Place.CONNECTION,
    parameters=(
        Quantity("gap", "m", 0.0, 5e-3, 8e-5, "free travel of the pin from side to side"),
        Quantity("film", "N s/m", 1.0, 1e4, 60.0, "drag of the grease"),
    ),
    meaning="the pin has play, with grease in it",
    act=force,
    fastest=fastest,
)
