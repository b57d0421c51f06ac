"""Unknown to the library: a nicked seal that catches on every n-th stroke, as the path travelled has it."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import PATH, Form, Place, V

SHARP = 12
"""[1] power that makes the catch short."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]."""
    turn = now[V] / (now[V] * now[V] + 4e-6) ** 0.5
    caught = max(math.cos(2.0 * math.pi * now[PATH] / values[1]), 0.0) ** SHARP
    return float(values[0] * caught * turn)


STICKING_SEAL = Form(
    effect="sticking_seal",
    form="every_nth_stroke",
    stage="damper",
    place=Place.PARALLEL,
    parameters=(
        Quantity("catch", "N", 0.0, 2000.0, 30.0, "largest force of a catch"),
        Quantity("path", "m", 1e-3, 2.0, 0.13, "path from catch to catch"),
    ),
    meaning="a nicked seal catches now and then",
    act=force,
    known=False,
)
