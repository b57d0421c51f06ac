"""Pickup from the mains: a wave with flat tops that swells and fades with what else is switched on."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import TIME, Form, Place

SWELL, SWELL_RATE = 0.3, 0.8
"""[1] relative and [rad/s] swelling."""
FLAT = 2.0
"""[1] how flat the tops are."""


def hum(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Pickup [N]."""
    turn = 2.0 * math.pi * values[1] * now[TIME] + values[2]
    wave = math.tanh(FLAT * math.sin(turn))
    return float(values[0] * (1.0 + SWELL * math.sin(SWELL_RATE * now[TIME])) * wave)


SWELLING_HUM = Form(
    effect="mains_hum",
    form="swelling_harmonics",
    stage="force_channel",
    place=Place.CELL,
    parameters=(
        Quantity("amplitude", "N", 0.0, 500.0, 4.0, "of the flat tops"),
        Quantity("frequency", "Hz", 45.0, 65.0, 50.0, "of the mains"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "at the start"),
    ),
    meaning="the load cell's cable picks up the mains",
    act=hum,
)
