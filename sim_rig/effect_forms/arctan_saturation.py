"""Saturation of the iron along an arctangent, which begins early and approaches its limit slowly."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import FIELD, AlternativeForm, Place


def compute_field(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the field [drive] that the fluid sees."""
    slope = 0.5 * math.pi * values[0]
    return float(now[FIELD]) if slope <= 0.0 else math.atan(slope * now[FIELD]) / slope


ARCTAN_SATURATION = AlternativeForm(
    effect="field_saturation",
    form="arctangent",
    stage="coil",
    place=Place.FIELD,
    parameters=(Quantity("inverse_saturation", "1/{drive}", 0.0, 50.0, 0.8, "inverse of the saturation field"),),
    meaning="the iron of the piston saturates",
    function=compute_field,
    former_symbols={"curve": "inverse_saturation"},
)
