"""Viscosity that falls with temperature after Arrhenius, in a thermal model of two nodes: fluid and cylinder."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import POWER, AlternativeForm, Place

ROOM_TEMPERATURE = 295.0
"""[K] at the start of the run."""
CAPACITY_RATIO = 4.0
"""[1] heat capacity of the cylinder over that of the fluid."""
COOLING_TIME = 150.0
"""[s] time constant with which the cylinder cools."""


def compute_factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the factor [1] on the damper's strength; the states are the warming of fluid and cylinder [K]."""
    transferred = (memory[0] - memory[1]) / values[2]
    rate[0] = now[POWER] / values[1] - transferred
    rate[1] = transferred / CAPACITY_RATIO - memory[1] / COOLING_TIME
    return math.exp(values[0] * (1.0 / (ROOM_TEMPERATURE + memory[0]) - 1.0 / ROOM_TEMPERATURE))


ARRHENIUS_HEATING = AlternativeForm(
    effect="viscous_heating",
    form="arrhenius_two_nodes",
    stage="damper",
    place=Place.DAMPER_GAIN,
    parameters=(
        Quantity("activation", "K", 0.0, 3e4, 2500.0, "activation energy over the gas constant"),
        Quantity("capacity", "J/K", 5.0, 1e4, 120.0, "heat capacity of the fluid"),
        Quantity("exchange", "s", 0.5, 300.0, 12.0, "time constant with which the fluid warms the cylinder"),
    ),
    meaning="the fluid warms with every stroke and becomes thinner",
    function=compute_factor,
    exponents=(0.4, 1.0, 1.0),
)
