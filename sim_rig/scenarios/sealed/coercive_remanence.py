"""Iron that remembers, whatever the rate: soft inside a coercive width, hard at its edge, and closed at the tips.

What the iron is behind obeys dq/du = -1 - sign(du) (q / width)^3, so that a small reversal leaves a minor loop; at
a large field the two branches meet again, as those of a real loop do.
"""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import FIELD, FIELD_RATE, Form, Place

CLOSING = 5.0
"""[1] field over the coercive width at which a third of the branches' distance has gone."""


def felt(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Field [drive] that the fluid feels; the memory is how far the iron is ahead [drive]."""
    edge = memory[0] / values[1]
    rate[0] = -now[FIELD_RATE] - abs(now[FIELD_RATE]) * edge**3
    return float(now[FIELD] + values[0] * memory[0] / math.cosh(now[FIELD] / (CLOSING * values[1])))


def fastest(share: float, width: float) -> float:
    """Fastest rate [1/s], for a field that turns at 100 drives a second."""
    return 300.0 / width


COERCIVE_REMANENCE = Form(
    effect="magnetic_remanence",
    form="closing_loop",
    stage="coil",
    place=Place.COIL,
    parameters=(
        Quantity("share", "1", 0.0, 1.0, 0.3, "part of the iron that remembers"),
        Quantity("width", "{drive}", 5e-3, 1.0, 0.08, "coercive width"),
    ),
    meaning="the iron stays magnetised after a larger drive",
    act=felt,
    fastest=fastest,
)
