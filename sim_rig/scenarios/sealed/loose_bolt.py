"""Unknown to the library: a bolt that opens at random for a while and then seats again."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import STRETCH, STRETCH_RATE, TIME, Form, Place

TIGHT = 5e-9
"""[m/N] what the seated bolt gives."""
LOSS = 2e-4
"""[s] damping over stiffness."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that the bolt carries: soft while it is open."""
    chance = math.sin(1.31 * now[TIME] + values[1]) + math.sin(0.47 * now[TIME] + 2.0 * values[1])
    opened = 0.5 * (1.0 + math.tanh(30.0 * (chance - 0.5)))
    return float((now[STRETCH] + LOSS * now[STRETCH_RATE]) / (TIGHT + values[0] * opened))


def fastest(give: float, phase: float) -> float:
    """Fastest rate [1/s]."""
    return 1.0 / LOSS


LOOSE_BOLT = Form(
    effect="loose_bolt",
    form="opens_at_random",
    stage="mounting",
    place=Place.CONNECTION,
    parameters=(
        Quantity("give", "m/N", 0.0, 1e-5, 2e-7, "what the open bolt gives for each newton"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "of its chances"),
    ),
    meaning="a bolt of the fixture opens now and then",
    act=force,
    fastest=fastest,
    known=False,
)
