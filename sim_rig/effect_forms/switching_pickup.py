"""Unknown to the library: the drive's switching, aliased by sampling to a beat proportional to the drive."""

import math
from typing import Any

from identification.damper import Quantity
from sim_rig.effect_forms.form import OUTPUT, TIME, AlternativeForm, Place


def compute_force(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Return the pickup [N]; its frequency drifts as two independent clocks do."""
    angle = 2.0 * math.pi * values[1] * now[TIME] + 9.0 * math.sin(0.21 * now[TIME])
    return float(values[0] * now[OUTPUT] * math.sin(angle))


SWITCHING_PICKUP = AlternativeForm(
    effect="switching_pickup",
    form="folded_beat",
    stage="force_channel",
    place=Place.LOAD_CELL_FORCE,
    parameters=(
        Quantity("pickup_gain", "N/{drive}", 0.0, 1e4, 20.0, "amplitude over the drive"),
        Quantity("frequency", "Hz", 0.5, 100.0, 17.3, "frequency of the beat"),
    ),
    meaning="the amplifier's switching couples into the load cell",
    function=compute_force,
    in_library=False,
    former_symbols={"pickup": "pickup_gain", "beat": "frequency"},
)
