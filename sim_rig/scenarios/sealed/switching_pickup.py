"""Unknown to the library: the drive's switching, folded down by sampling to a beat that grows with the drive."""

import math
from typing import Any

from identification.damper.parameters import Quantity
from sim_rig.scenarios.sealed.form import OUTPUT, TIME, Form, Place


def pickup(now: Any, memory: Any, values: Any, rate: Any) -> float:
    """Pickup [N]: its frequency wanders as two clocks do."""
    turn = 2.0 * math.pi * values[1] * now[TIME] + 9.0 * math.sin(0.21 * now[TIME])
    return float(values[0] * now[OUTPUT] * math.sin(turn))


SWITCHING_PICKUP = Form(
    effect="switching_pickup",
    form="folded_beat",
    stage="force_channel",
    place=Place.CELL,
    parameters=(
        Quantity("pickup", "N/{drive}", 0.0, 1e4, 20.0, "amplitude over the drive"),
        Quantity("beat", "Hz", 0.5, 100.0, 17.3, "frequency of the beat"),
    ),
    meaning="the amplifier's switching gets into the load cell",
    act=pickup,
    known=False,
)
