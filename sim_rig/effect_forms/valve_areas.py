"""Two valves of different area: the damper is stronger in extension, with a smooth change at a small velocity."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, V


def compute_factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the factor [1] on the damper's strength: 1 in compression, 1 + extension_gain in extension."""
    return float(1.0 + values[0] * 0.5 * (1.0 + math.tanh((now[V] - values[1]) / values[2])))


VALVE_AREAS = AlternativeForm(
    effect="direction_asymmetry",
    form="two_valves",
    stage="damper",
    place=Place.DAMPER_GAIN,
    parameters=(
        Quantity("extension_gain", "1", 0.0, 3.0, 0.2, "relative increase in extension"),
        Quantity("opening_velocity", "m/s", 0.0, 0.1, 4e-3, "velocity at which the second valve is half open"),
        Quantity("softness", "m/s", 1e-3, 0.2, 0.012, "width of the change"),
    ),
    meaning="extension and compression use different valves",
    function=compute_factor,
    exponents=(0.7, 1.0, 1.0),
    former_symbols={"more": "extension_gain", "opens": "opening_velocity"},
)
