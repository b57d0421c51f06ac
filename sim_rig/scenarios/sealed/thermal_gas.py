"""Gas that warms as it is compressed and gives the heat to the wall: between adiabatic and isothermal.

Ideal gas in the real volume 1 + x / length: pressure = (1 + theta) / (1 + x / length), relative to rest.
"""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V, X

HEAT_RATIO = 1.4
"""[1] of nitrogen."""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]; the memory is the relative warming theta [1]."""
    volume = 1.0 + now[X] / values[1]
    warming = -(HEAT_RATIO - 1.0) * (1.0 + memory[0]) * now[V] / values[1] / volume
    rate[0] = warming - memory[0] / values[2]
    return float(-values[0] * ((1.0 + memory[0]) / volume - 1.0))


THERMAL_GAS = Form(
    effect="gas_spring",
    form="gas_with_wall",
    stage="damper",
    place=Place.PARALLEL,
    parameters=(
        Quantity("preload", "N", 0.0, 5000.0, 90.0, "gas force at rest"),
        Quantity("length", "m", 0.02, 1.0, 0.045, "length of the gas column at rest"),
        Quantity("exchange", "s", 0.01, 60.0, 0.4, "time in which the gas takes the wall's temperature"),
    ),
    meaning="the gas behind the piston",
    act=force,
)
