"""Unknown to the library: a check valve sticks irregularly for a while and strengthens extension meanwhile."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import TIME, AlternativeForm, Place, V

TRANSITION_SPEED = 0.01
"""[m/s] over which the flow reverses."""


def compute_factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the factor [1] on the damper's strength: above 1 in extension while the valve sticks."""
    pattern = math.sin(0.9 * now[TIME] + values[1]) + math.sin(0.37 * now[TIME] + 3.0 * values[1])
    sticking = 0.5 * (1.0 + math.tanh(20.0 * (pattern - 0.4)))
    return float(1.0 + values[0] * sticking * 0.5 * (1.0 + math.tanh(now[V] / TRANSITION_SPEED)))


HANGING_VALVE = AlternativeForm(
    effect="hanging_valve",
    form="hangs_at_random",
    stage="damper",
    place=Place.DAMPER_GAIN,
    parameters=(
        Quantity("extension_gain", "1", 0.0, 3.0, 0.2, "relative increase in extension while the valve sticks"),
        Quantity("phase", "rad", 0.0, 7.0, 1.0, "phase of the irregular pattern"),
    ),
    meaning="a check valve sticks now and then",
    function=compute_factor,
    exponents=(0.7, 1.0, 1.0),
    in_library=False,
    former_symbols={"more": "extension_gain"},
)
