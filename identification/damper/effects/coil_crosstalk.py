"""Crosstalk of the coil into the load cell: the zero of the force moves with the drive."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_crosstalk(time: Any, drive: Any, gain: Any) -> Any:
    """Return the added force [N] at a drive [V or A]; the time has no influence."""
    return gain * drive + 0.0 * time


COIL_CROSSTALK = Effect(
    name="coil_crosstalk",
    stage="force_channel",
    variable="drive",
    meaning="the coil's drive leaks into the force channel",
    forms=(
        Form(
            "proportional",
            "additive_force",
            (Quantity("gain", "N/{drive}", -1e4, 1e4, 10.0, "force per unit of drive"),),
            ((0.0,),),
            compute_crosstalk,
        ),
    ),
)
