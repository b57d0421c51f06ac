"""Fluid that thins as it warms, after Arrhenius, in a cylinder that warms behind it: two nodes."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import POWER, Form, Place

ROOM = 295.0
"""[K] at the start."""
BODY = 4.0
"""[1] heat capacity of the cylinder over that of the fluid."""
COOLING = 150.0
"""[s] time constant with which the cylinder cools."""


def factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Factor [1] on the damper's strength; the memory is the warming of fluid and cylinder [K]."""
    passed = (memory[0] - memory[1]) / values[2]
    rate[0] = now[POWER] / values[1] - passed
    rate[1] = passed / BODY - memory[1] / COOLING
    return math.exp(values[0] * (1.0 / (ROOM + memory[0]) - 1.0 / ROOM))


ARRHENIUS_HEATING = Form(
    effect="viscous_heating",
    form="arrhenius_two_nodes",
    stage="damper",
    place=Place.SCALE,
    parameters=(
        Quantity("activation", "K", 0.0, 3e4, 2500.0, "activation energy over the gas constant"),
        Quantity("capacity", "J/K", 5.0, 1e4, 120.0, "heat capacity of the fluid"),
        Quantity("exchange", "s", 0.5, 300.0, 12.0, "time in which the fluid warms the cylinder"),
    ),
    meaning="the fluid warms with every stroke and thins",
    act=factor,
    weights=(0.4, 1.0, 1.0),
)
