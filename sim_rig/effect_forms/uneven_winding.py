"""Unevenly wound LVDT: it reads too much near one position of its stroke only."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, X


def compute_reading(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the displacement [m] that the LVDT reads."""
    offset = (now[X] - values[1]) / values[2]
    return float(now[X] + values[0] * math.exp(-offset * offset))


UNEVEN_WINDING = AlternativeForm(
    effect="displacement_nonlinearity",
    form="uneven_winding",
    stage="displacement_channel",
    place=Place.DISPLACEMENT_CHANNEL,
    parameters=(
        Quantity("error", "m", 0.0, 5e-3, 1e-4, "largest error"),
        Quantity("position", "m", -0.2, 0.2, 5e-3, "position of the largest error"),
        Quantity("width", "m", 1e-3, 0.5, 8e-3, "distance at which the error has fallen to 1/e"),
    ),
    meaning="the displacement sensor is not linear",
    function=compute_reading,
    former_symbols={"place": "position"},
)
