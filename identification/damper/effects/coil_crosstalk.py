"""A load cell that feels the coil: its zero moves with the drive."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def felt(time: Any, drive: Any, gain: Any) -> Any:
    """Force [N] that the channel adds at a drive [V or A]; the time plays no part."""
    return gain * drive + 0.0 * time


COIL_CROSSTALK = Effect(
    name="coil_crosstalk",
    stage="force_channel",
    meaning="the coil's drive leaks into the force channel",
    forms=(
        Form(
            "proportional",
            "added_force",
            (Quantity("gain", "N/{drive}", -1e4, 1e4, 10.0, "force for each unit of drive"),),
            ((0.0,),),
            felt,
        ),
    ),
)
