"""Bessel filter of fourth order in the force channel, whose delay varies slightly over time.

The prototype (s² + 5.79242 s + 9.14013) (s² + 4.20758 s + 11.4878) has a delay of one and is realised as two
sections.
"""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import FORCE, TIME, AlternativeForm, Place

MODULATION, MODULATION_RATE = 0.05, 4.4
"""[1] relative amplitude and [rad/s] angular frequency of the variation of the delay."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N] after the filter; the states are two per section."""
    if values[0] <= 0.0:
        return float(now[FORCE])
    speed = 1.0 / (values[0] * (1.0 + MODULATION * math.sin(MODULATION_RATE * now[TIME])))
    rate[0] = speed * memory[1]
    rate[1] = speed * (9.14013 * (now[FORCE] - memory[0]) - 5.79242 * memory[1])
    rate[2] = speed * memory[3]
    rate[3] = speed * (11.4878 * (memory[0] - memory[2]) - 4.20758 * memory[3])
    return float(memory[2])


def compute_max_rate(delay: float) -> float:
    """Return the fastest rate [1/s] of the filter."""
    return 3.6 / max(delay, 2e-5)


BESSEL_DELAY = AlternativeForm(
    effect="force_delay",
    form="bessel_chain",
    stage="force_channel",
    place=Place.FORCE_CHANNEL,
    parameters=(Quantity("delay", "s", 0.0, 0.05, 1.5e-3, "delay of the filter for slow signals"),),
    meaning="the load cell's amplifier filters more than it reports",
    function=compute_force,
    max_rate=compute_max_rate,
)
