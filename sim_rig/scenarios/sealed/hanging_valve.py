"""Unknown to the library: a check valve that hangs at random for a while, and stiffens extension meanwhile."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import TIME, Form, Place, V

OPENS = 0.01
"""[m/s] over which the flow turns round."""


def factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Factor [1] on the damper's strength: more than 1 in extension while the valve hangs."""
    chance = math.sin(0.9 * now[TIME] + values[1]) + math.sin(0.37 * now[TIME] + 3.0 * values[1])
    hangs = 0.5 * (1.0 + math.tanh(20.0 * (chance - 0.4)))
    return float(1.0 + values[0] * hangs * 0.5 * (1.0 + math.tanh(now[V] / OPENS)))


HANGING_VALVE = Form(
    effect="hanging_valve",
    form="hangs_at_random",
    stage="damper",
    place=Place.SCALE,
    parameters=(
        Quantity("more", "1", 0.0, 3.0, 0.2, "what extension has more while the valve hangs, as a part"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "of its chances"),
    ),
    meaning="a check valve hangs now and then",
    act=factor,
    weights=(0.7, 1.0, 1.0),
    known=False,
)
