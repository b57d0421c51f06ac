"""Unknown to the library: a fan that is switched on and off; the damper stiffens in its draught, work or rest."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import TIME, Form, Place


def factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Factor [1] on the damper's strength; the memory is how much of the draught has reached it [1]."""
    blowing = 1.0 if values[1] <= now[TIME] < values[2] else 0.0
    rate[0] = (blowing - memory[0]) / values[3]
    return math.exp(values[0] * memory[0])


FAN_STEP = Form(
    effect="fan_step",
    form="on_and_off",
    stage="damper",
    place=Place.SCALE,
    parameters=(
        Quantity("stiffer", "1", 0.0, 2.0, 0.1, "logarithm of what the draught does in the end"),
        Quantity("start", "s", 0.0, 1e4, 10.0, "when the fan starts"),
        Quantity("stop", "s", 0.0, 1e4, 25.0, "when it stops"),
        Quantity("time", "s", 0.1, 100.0, 1.5, "time constant of the fluid"),
    ),
    meaning="a fan is switched on and off beside the damper",
    act=factor,
    weights=(1.0, 1.0, 1.0),
    known=False,
)
