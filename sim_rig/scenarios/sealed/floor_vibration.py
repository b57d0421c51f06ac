"""Unknown to the library: a machine next door that shakes the floor in bursts."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import TIME, Form, Place


def shake(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] on the load cell."""
    burst = math.exp(-5.0 * (1.0 - math.cos(2.0 * math.pi * now[TIME] / values[2])))
    return float(values[0] * burst * math.sin(2.0 * math.pi * values[1] * now[TIME]))


FLOOR_VIBRATION = Form(
    effect="floor_vibration",
    form="bursts",
    stage="mounting",
    place=Place.CELL,
    parameters=(
        Quantity("shake", "N", 0.0, 2000.0, 15.0, "largest force"),
        Quantity("frequency", "Hz", 2.0, 80.0, 11.3, "of the machine"),
        Quantity("period", "s", 0.5, 60.0, 3.7, "from burst to burst"),
    ),
    meaning="a machine next door shakes the floor",
    act=shake,
    known=False,
)
