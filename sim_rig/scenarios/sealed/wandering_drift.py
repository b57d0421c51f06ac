"""A zero that warms up as heat soaks in, by a root of time, and wanders: a walk of sines that never repeat."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import TIME, Form, Place

STEPS = 5
"""Sines of the walk."""
SLOWEST = 0.011
"""[Hz] of the walk."""
RESTLESS = 0.35
"""[1] size of the walk's first sine over that of the warm-up."""


def shift(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Shift of the zero [N]."""
    walk = 0.0
    for k in range(1, STEPS + 1):
        pulse = 2.0 * math.pi * SLOWEST * k**1.07
        walk += (math.sin(pulse * now[TIME] + values[2] * k * k) - math.sin(values[2] * k * k)) / k
    return float(values[0] * (1.0 - (1.0 + max(now[TIME], 0.0) / values[1]) ** -0.5 + RESTLESS * walk))


WANDERING_DRIFT = Form(
    effect="force_drift",
    form="warm_up_and_walk",
    stage="force_channel",
    place=Place.CELL,
    parameters=(
        Quantity("warm_up", "N", -2000.0, 2000.0, 10.0, "by which the zero moves while the channel warms"),
        Quantity("time", "s", 1.0, 1000.0, 10.0, "time after which three tenths of the warm-up are done"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "at which the walk begins"),
    ),
    meaning="the zero of the load cell wanders",
    act=shift,
)
