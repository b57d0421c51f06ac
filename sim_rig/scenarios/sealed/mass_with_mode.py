"""Mass between load cell and damper, a part of it on a bracket that rings."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import ACCELERATION, Form, Place

HANGING = 0.35
"""[1] part of the mass that hangs on the bracket."""
DAMPING = 0.08
"""[1] damping ratio of the bracket."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]; the memory is how far [m] and how fast [m/s] the hanging part is ahead."""
    pulse = 2.0 * math.pi * values[1]
    held_back = pulse * pulse * memory[0] + 2.0 * DAMPING * pulse * memory[1]
    rate[0] = memory[1]
    rate[1] = -now[ACCELERATION] - held_back
    return float(values[0] * ((1.0 - HANGING) * now[ACCELERATION] - HANGING * held_back))


def fastest(mass: float, frequency: float) -> float:
    """Fastest rate [1/s]."""
    return 2.0 * math.pi * frequency


MASS_WITH_MODE = Form(
    effect="moving_mass",
    form="mass_with_bracket",
    stage="mounting",
    place=Place.CELL,
    parameters=(
        Quantity("mass", "kg", 0.0, 40.0, 1.5, "mass between load cell and damper"),
        Quantity("frequency", "Hz", 5.0, 300.0, 45.0, "at which the bracket rings"),
    ),
    meaning="the load cell carries mass of the fixture",
    act=force,
    fastest=fastest,
)
