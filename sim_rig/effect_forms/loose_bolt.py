"""Unknown to the library: a bolt of the fixture opens irregularly for a while and then seats again."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import ELONGATION, ELONGATION_RATE, TIME, AlternativeForm, Place

SEATED_COMPLIANCE = 5e-9
"""[m/N] compliance of the seated bolt."""
RETARDATION_TIME = 2e-4
"""[s] damping over stiffness."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N] that the bolt transmits; it is compliant while open."""
    pattern = math.sin(1.31 * now[TIME] + values[1]) + math.sin(0.47 * now[TIME] + 2.0 * values[1])
    opening = 0.5 * (1.0 + math.tanh(30.0 * (pattern - 0.5)))
    return float(
        (now[ELONGATION] + RETARDATION_TIME * now[ELONGATION_RATE]) / (SEATED_COMPLIANCE + values[0] * opening)
    )


def compute_max_rate(compliance: float, phase: float) -> float:
    """Return the fastest rate [1/s] of the damped bolt."""
    return 1.0 / RETARDATION_TIME


LOOSE_BOLT = AlternativeForm(
    effect="loose_bolt",
    form="opens_at_random",
    stage="mounting",
    place=Place.MOUNTING,
    parameters=(
        Quantity("compliance", "m/N", 0.0, 1e-5, 2e-7, "compliance of the open bolt"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "phase of the irregular pattern"),
    ),
    meaning="a bolt of the fixture opens now and then",
    function=compute_force,
    max_rate=compute_max_rate,
    in_library=False,
    former_symbols={"give": "compliance"},
)
