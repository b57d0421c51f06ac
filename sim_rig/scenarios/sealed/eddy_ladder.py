"""Eddy currents in solid iron, as a ladder of two more lags through which a part of the field has to go."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import FIELD, FIELD_RATE, Form, Place

DEEP = 0.6
"""[1] part of the field that stands deep in the iron."""
FASTER = 3.0
"""[1] by which the second rung is faster than the first."""


def felt(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Field [drive] that the fluid feels; the memory is what each rung is behind [drive]."""
    if values[0] <= 0.0:
        return float(now[FIELD])
    rate[0] = -memory[0] / values[0] - now[FIELD_RATE]
    rate[1] = FASTER * (memory[0] - memory[1]) / values[0] - now[FIELD_RATE]
    return float(now[FIELD] + DEEP * memory[1])


def fastest(time: float) -> float:
    """Fastest rate [1/s]."""
    return FASTER / max(time, 1e-4)


EDDY_LADDER = Form(
    effect="coil_lag",
    form="eddy_ladder",
    stage="coil",
    place=Place.COIL,
    parameters=(Quantity("time", "s", 0.0, 0.5, 0.02, "time constant of the first rung"),),
    meaning="eddy currents keep the field from following the drive",
    act=felt,
    fastest=fastest,
)
