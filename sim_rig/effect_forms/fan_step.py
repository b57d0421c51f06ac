"""Unknown to the library: a fan is switched on and off, and the cooled damper stiffens whether it moves or not."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import TIME, AlternativeForm, Place


def compute_factor(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the factor [1] on the damper's strength; the state is the lagged state of the fan, 0 to 1."""
    fan_on = 1.0 if values[1] <= now[TIME] < values[2] else 0.0
    rate[0] = (fan_on - memory[0]) / values[3]
    return math.exp(values[0] * memory[0])


FAN_STEP = AlternativeForm(
    effect="fan_step",
    form="on_and_off",
    stage="damper",
    place=Place.DAMPER_GAIN,
    parameters=(
        Quantity("log_gain", "1", 0.0, 2.0, 0.1, "logarithm of the final factor"),
        Quantity("start", "s", 0.0, 1e4, 10.0, "time at which the fan starts"),
        Quantity("stop", "s", 0.0, 1e4, 25.0, "time at which it stops"),
        Quantity("time_constant", "s", 0.1, 100.0, 1.5, "time constant of the fluid"),
    ),
    meaning="a fan next to the damper is switched on and off",
    function=compute_factor,
    exponents=(1.0, 1.0, 1.0),
    in_library=False,
    former_symbols={"stiffer": "log_gain", "time": "time_constant"},
)
