"""Unknown to the library: a neighbouring machine shakes the floor in bursts."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import TIME, AlternativeForm, Place


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the additional force [N] on the load cell."""
    burst = math.exp(-5.0 * (1.0 - math.cos(2.0 * math.pi * now[TIME] / values[2])))
    return float(values[0] * burst * math.sin(2.0 * math.pi * values[1] * now[TIME]))


FLOOR_VIBRATION = AlternativeForm(
    effect="floor_vibration",
    form="bursts",
    stage="mounting",
    place=Place.LOAD_CELL_FORCE,
    parameters=(
        Quantity("amplitude", "N", 0.0, 2000.0, 15.0, "largest force"),
        Quantity("frequency", "Hz", 2.0, 80.0, 11.3, "frequency of the machine"),
        Quantity("period", "s", 0.5, 60.0, 3.7, "time from burst to burst"),
    ),
    meaning="a neighbouring machine shakes the floor",
    function=compute_force,
    in_library=False,
    former_symbols={"shake": "amplitude"},
)
