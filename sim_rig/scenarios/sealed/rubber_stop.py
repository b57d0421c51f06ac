"""A rubber buffer near one end: it stiffens as it is squeezed, relaxes meanwhile, and never pulls."""

from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import Form, Place, V, X

RELAXING = 0.8
"""[1] stiffness of the relaxing arm over that at one millimetre."""
RELAXATION = 0.08
"""[s] its time constant."""
MILLIMETRE = 1e-3
"""[m]"""


def force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Force [N]; the memory is the stretch of the relaxing arm [m]."""
    depth = values[2] * now[X] - values[1]
    squeezing = values[2] * now[V] if depth > 0.0 else 0.0
    rate[0] = squeezing - memory[0] / RELAXATION
    if depth <= 0.0:
        return 0.0
    pressing = values[0] * (depth * (depth / MILLIMETRE) ** 0.5 + RELAXING * memory[0])
    return float(values[2] * max(pressing, 0.0))


RUBBER_STOP = Form(
    effect="end_stop",
    form="relaxing_rubber",
    stage="damper",
    place=Place.PARALLEL,
    parameters=(
        Quantity("stiffness", "N/m", 0.0, 1e7, 3e4, "stiffness at one millimetre"),
        Quantity("gap", "m", 0.0, 0.2, 8e-3, "free travel from zero"),
        Quantity("sense", "1", -1.0, 1.0, 1.0, "1 at the extended end, -1 at the other"),
    ),
    meaning="the piston meets its buffer before the end of the stroke",
    act=force,
)
