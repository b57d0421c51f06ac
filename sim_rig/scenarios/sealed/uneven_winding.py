"""An LVDT that is wound unevenly: near one place of its stroke it reads too much, and nowhere else."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, X


def read(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Displacement [m] that is read."""
    off = (now[X] - values[1]) / values[2]
    return float(now[X] + values[0] * math.exp(-off * off))


UNEVEN_WINDING = Form(
    effect="displacement_nonlinearity",
    form="uneven_winding",
    stage="displacement_channel",
    place=Place.POSITION,
    parameters=(
        Quantity("error", "m", 0.0, 5e-3, 1e-4, "largest error"),
        Quantity("place", "m", -0.2, 0.2, 5e-3, "where it is largest"),
        Quantity("width", "m", 1e-3, 0.5, 8e-3, "distance at which a third of it is left"),
    ),
    meaning="the displacement sensor is not straight",
    act=read,
)
