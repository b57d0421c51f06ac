"""Zero drift of the force channel: warm-up with the inverse root of time, and a walk of incommensurate sines."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import TIME, AlternativeForm, Place

SINE_COUNT = 5
"""Number of sines of the walk."""
BASE_FREQUENCY = 0.011
"""[Hz] frequency of the first sine of the walk."""
WALK_RATIO = 0.35
"""[1] amplitude of the first sine over the warm-up."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the shift of the zero [N]."""
    walk = 0.0
    for k in range(1, SINE_COUNT + 1):
        omega = 2.0 * math.pi * BASE_FREQUENCY * k**1.07
        walk += (math.sin(omega * now[TIME] + values[2] * k * k) - math.sin(values[2] * k * k)) / k
    return float(values[0] * (1.0 - (1.0 + max(now[TIME], 0.0) / values[1]) ** -0.5 + WALK_RATIO * walk))


WARM_UP_DRIFT = AlternativeForm(
    effect="force_drift",
    form="warm_up_and_walk",
    stage="force_channel",
    place=Place.LOAD_CELL_FORCE,
    parameters=(
        Quantity("warm_up", "N", -2000.0, 2000.0, 10.0, "shift of the zero while the channel warms up"),
        Quantity("time_constant", "s", 1.0, 1000.0, 10.0, "time after which three tenths of the warm-up are done"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "phase of the walk at the start"),
    ),
    meaning="the zero of the load cell drifts",
    function=compute_force,
    former_symbols={"time": "time_constant"},
)
