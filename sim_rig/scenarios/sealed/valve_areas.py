"""Two valves of different area: the damper is stronger in extension, and the one gives way to the other softly."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V


def factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Factor [1] on the damper's strength: 1 in compression, 1 + more in extension."""
    return float(1.0 + values[0] * 0.5 * (1.0 + math.tanh((now[V] - values[1]) / values[2])))


VALVE_AREAS = Form(
    effect="direction_asymmetry",
    form="two_valves",
    stage="damper",
    place=Place.SCALE,
    parameters=(
        Quantity("more", "1", 0.0, 3.0, 0.2, "what extension has more, as a part"),
        Quantity("opens", "m/s", 0.0, 0.1, 4e-3, "velocity at which the second valve is half open"),
        Quantity("softness", "m/s", 1e-3, 0.2, 0.012, "width of that change"),
    ),
    meaning="extension and compression go through different valves",
    act=factor,
    weights=(0.7, 1.0, 1.0),
)
