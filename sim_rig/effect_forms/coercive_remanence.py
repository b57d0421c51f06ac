"""Rate-independent magnetic hysteresis with a coercive width, whose branches meet at large fields.

The hysteretic state q obeys dq/du = -1 - sign(du) (q / width)³, so that a small reversal makes a minor loop. At a
large field the two branches close, as those of a real magnetisation loop do.
"""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import FIELD, FIELD_RATE, AlternativeForm, Place

CLOSURE_RATIO = 5.0
"""[1] field over the coercive width at which the distance of the branches has fallen by a third."""


def compute_field(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the field [drive] that the fluid sees; the state is the hysteretic part of the field [drive]."""
    edge = memory[0] / values[1]
    rate[0] = -now[FIELD_RATE] - abs(now[FIELD_RATE]) * edge**3
    return float(now[FIELD] + values[0] * memory[0] / math.cosh(now[FIELD] / (CLOSURE_RATIO * values[1])))


def compute_max_rate(share: float, width: float) -> float:
    """Return the fastest rate [1/s], for a field that changes by 100 [drive] per second."""
    return 300.0 / width


COERCIVE_REMANENCE = AlternativeForm(
    effect="magnetic_remanence",
    form="closing_loop",
    stage="coil",
    place=Place.FIELD,
    parameters=(
        Quantity("share", "1", 0.0, 1.0, 0.3, "part of the field that is hysteretic"),
        Quantity("width", "{drive}", 5e-3, 1.0, 0.08, "coercive width"),
    ),
    meaning="the iron stays magnetised after a larger drive",
    function=compute_field,
    max_rate=compute_max_rate,
)
