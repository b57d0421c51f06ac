"""Mass between load cell and damper, a part of it on a resonant bracket."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import ACCELERATION, AlternativeForm, Place

BRACKET_FRACTION = 0.35
"""[1] part of the mass that the bracket carries."""
DAMPING_RATIO = 0.08
"""[1] damping ratio of the bracket."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N]; the states are relative displacement [m] and velocity [m/s] of the bracket."""
    omega = 2.0 * math.pi * values[1]
    restoring = omega * omega * memory[0] + 2.0 * DAMPING_RATIO * omega * memory[1]
    rate[0] = memory[1]
    rate[1] = -now[ACCELERATION] - restoring
    return float(values[0] * ((1.0 - BRACKET_FRACTION) * now[ACCELERATION] - BRACKET_FRACTION * restoring))


def compute_max_rate(mass: float, frequency: float) -> float:
    """Return the angular frequency [1/s] of the bracket."""
    return 2.0 * math.pi * frequency


MASS_WITH_MODE = AlternativeForm(
    effect="moving_mass",
    form="mass_with_bracket",
    stage="mounting",
    place=Place.LOAD_CELL_FORCE,
    parameters=(
        Quantity("mass", "kg", 0.0, 40.0, 1.5, "mass between load cell and damper"),
        Quantity("frequency", "Hz", 5.0, 300.0, 45.0, "natural frequency of the bracket"),
    ),
    meaning="the load cell carries part of the fixture's mass",
    function=compute_force,
    max_rate=compute_max_rate,
)
