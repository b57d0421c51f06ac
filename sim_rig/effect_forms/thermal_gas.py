"""Gas spring with heat exchange with its wall: between adiabatic and isothermal compression.

Ideal gas of relative temperature 1 + theta in the relative volume 1 + x / length; the pressure relative to rest is
(1 + theta) / (1 + x / length).
"""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, V, X

HEAT_RATIO = 1.4
"""[1] heat capacity ratio of nitrogen."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N]; the state is the relative warming theta [1]."""
    volume = 1.0 + now[X] / values[1]
    warming = -(HEAT_RATIO - 1.0) * (1.0 + memory[0]) * now[V] / values[1] / volume
    rate[0] = warming - memory[0] / values[2]
    return float(-values[0] * ((1.0 + memory[0]) / volume - 1.0))


THERMAL_GAS = AlternativeForm(
    effect="gas_spring",
    form="gas_with_wall",
    stage="damper",
    place=Place.PARALLEL_FORCE,
    parameters=(
        Quantity("preload", "N", 0.0, 5000.0, 90.0, "gas force at rest"),
        Quantity("length", "m", 0.02, 1.0, 0.045, "length of the gas column at rest"),
        Quantity(
            "exchange", "s", 0.01, 60.0, 0.4, "time constant with which the gas takes the wall's temperature"
        ),
    ),
    meaning="gas behind the piston acts as a spring",
    function=compute_force,
)
