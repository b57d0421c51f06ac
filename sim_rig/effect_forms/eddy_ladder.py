"""Eddy currents in solid iron, as a ladder of two further lags that delay a part of the field."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import FIELD, FIELD_RATE, AlternativeForm, Place

DEEP_FRACTION = 0.6
"""[1] part of the field that passes through both lags, deep in the iron."""
RATE_RATIO = 3.0
"""[1] rate of the second lag over that of the first."""


def compute_field(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the field [drive] that the fluid sees; the states are minus the deficits of both lags [drive]."""
    if values[0] <= 0.0:
        return float(now[FIELD])
    rate[0] = -memory[0] / values[0] - now[FIELD_RATE]
    rate[1] = RATE_RATIO * (memory[0] - memory[1]) / values[0] - now[FIELD_RATE]
    return float(now[FIELD] + DEEP_FRACTION * memory[1])


def compute_max_rate(time_constant: float) -> float:
    """Return the rate [1/s] of the second lag."""
    return RATE_RATIO / max(time_constant, 1e-4)


EDDY_LADDER = AlternativeForm(
    effect="coil_lag",
    form="eddy_ladder",
    stage="coil",
    place=Place.FIELD,
    parameters=(Quantity("time_constant", "s", 0.0, 0.5, 0.02, "time constant of the first lag"),),
    meaning="eddy currents delay the field behind the drive",
    function=compute_field,
    max_rate=compute_max_rate,
    former_symbols={"time": "time_constant"},
)
