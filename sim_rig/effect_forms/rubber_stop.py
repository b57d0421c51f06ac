"""Rubber buffer near one end of the stroke: progressive, relaxing (viscoelastic), and in compression only."""

from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import AlternativeForm, Place, V, X

RELAXATION_RATIO = 0.8
"""[1] stiffness of the relaxing (Maxwell) arm over that at one millimetre."""
RELAXATION_TIME = 0.08
"""[s] time constant of the relaxing arm."""
REFERENCE_DEPTH = 1e-3
"""[m] indentation at which the stiffness is defined."""


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the force [N]; the state is the elongation of the relaxing arm [m]."""
    depth = values[2] * now[X] - values[1]
    squeeze_rate = values[2] * now[V] if depth > 0.0 else 0.0
    rate[0] = squeeze_rate - memory[0] / RELAXATION_TIME
    if depth <= 0.0:
        return 0.0
    contact_force = values[0] * (depth * (depth / REFERENCE_DEPTH) ** 0.5 + RELAXATION_RATIO * memory[0])
    return float(values[2] * max(contact_force, 0.0))


RUBBER_STOP = AlternativeForm(
    effect="end_stop",
    form="relaxing_rubber",
    stage="damper",
    place=Place.PARALLEL_FORCE,
    parameters=(
        Quantity("stiffness", "N/m", 0.0, 1e7, 3e4, "stiffness at one millimetre"),
        Quantity("gap", "m", 0.0, 0.2, 8e-3, "free travel from the centre"),
        Quantity("direction", "1", -1.0, 1.0, 1.0, "1 at the extended end, -1 at the other"),
    ),
    meaning="the piston touches its buffer before the end of the stroke",
    function=compute_force,
    former_symbols={"sense": "direction"},
)
