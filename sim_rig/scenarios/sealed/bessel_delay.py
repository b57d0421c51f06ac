"""A force channel behind a Bessel filter of fourth order, whose delay wanders a little.

The prototype with a delay of one, (s² + 5.79242 s + 9.14013) (s² + 4.20758 s + 11.4878), as two sections.
"""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import FORCE, TIME, Form, Place

WANDER, WANDER_RATE = 0.05, 4.4
"""[1] relative and [rad/s] wander of the delay."""


def filtered(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N] that leaves the channel; the memory is that of two sections."""
    if values[0] <= 0.0:
        return float(now[FORCE])
    pace = 1.0 / (values[0] * (1.0 + WANDER * math.sin(WANDER_RATE * now[TIME])))
    rate[0] = pace * memory[1]
    rate[1] = pace * (9.14013 * (now[FORCE] - memory[0]) - 5.79242 * memory[1])
    rate[2] = pace * memory[3]
    rate[3] = pace * (11.4878 * (memory[0] - memory[2]) - 4.20758 * memory[3])
    return float(memory[2])


def fastest(delay: float) -> float:
    """Fastest rate [1/s]."""
    return 3.6 / max(delay, 2e-5)


BESSEL_DELAY = Form(
    effect="force_delay",
    form="bessel_chain",
    stage="force_channel",
    place=Place.CHANNEL,
    parameters=(Quantity("delay", "s", 0.0, 0.05, 1.5e-3, "delay of the filter for slow signals"),),
    meaning="the load cell's amplifier filters more than it says",
    act=filtered,
    fastest=fastest,
)
