"""An LVDT whose windings are not even: an error that is a sine over the position."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, X


def read(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Displacement [m] that is read."""
    return float(now[X] + values[0] * math.sin(2.0 * math.pi * now[X] / values[1]))


PITCH_ERROR = Form(
    effect="displacement_nonlinearity",
    form="pitch_error",
    stage="displacement_channel",
    place=Place.POSITION,
    parameters=(
        Quantity("error", "m", 0.0, 5e-3, 1e-4, "largest error"),
        Quantity("pitch", "m", 1e-3, 0.5, 0.024, "length over which it repeats"),
    ),
    meaning="the displacement sensor is not straight",
    act=read,
)
