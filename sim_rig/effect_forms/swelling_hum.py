"""Pickup from the mains: a wave with flat tops whose amplitude is slowly modulated by other loads."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import TIME, AlternativeForm, Place

MODULATION, MODULATION_RATE = 0.3, 0.8
"""[1] relative amplitude and [rad/s] angular frequency of the modulation."""
CLIPPING = 2.0
"""[1] flatness of the tops: argument of the hyperbolic tangent at the crest."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the pickup [N]."""
    angle = 2.0 * math.pi * values[1] * now[TIME] + values[2]
    wave = math.tanh(CLIPPING * math.sin(angle))
    return float(values[0] * (1.0 + MODULATION * math.sin(MODULATION_RATE * now[TIME])) * wave)


SWELLING_HUM = AlternativeForm(
    effect="mains_hum",
    form="swelling_harmonics",
    stage="force_channel",
    place=Place.LOAD_CELL_FORCE,
    parameters=(
        Quantity("amplitude", "N", 0.0, 500.0, 4.0, "amplitude of the flat tops"),
        Quantity("frequency", "Hz", 45.0, 65.0, 50.0, "mains frequency"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "phase at the start of the run"),
    ),
    meaning="the load cell's cable picks up the mains",
    function=compute_force,
)
