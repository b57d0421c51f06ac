"""Iron that saturates along an arctangent: slow to begin, and never quite full."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import FIELD, Form, Place


def felt(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Field [drive] that the fluid feels."""
    bend = 0.5 * math.pi * values[0]
    return float(now[FIELD]) if bend <= 0.0 else math.atan(bend * now[FIELD]) / bend


ARCTAN_SATURATION = Form(
    effect="field_saturation",
    form="arctangent",
    stage="coil",
    place=Place.COIL,
    parameters=(Quantity("curve", "1/{drive}", 0.0, 50.0, 0.8, "inverse of the field of full iron"),),
    meaning="the iron of the piston saturates",
    act=felt,
)
