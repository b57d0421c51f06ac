"""Mass between load cell and damper (rod, clevis, adapter): the cell measures its inertia force."""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def compute_inertia(acceleration: Any, mass: Any) -> Any:
    """Return the force [N] on the load cell at the actuator's acceleration [m/s²]."""
    return mass * acceleration


MOVING_MASS = Effect(
    name="moving_mass",
    stage="mounting",
    variable="acceleration",
    meaning="the load cell also accelerates the mass between it and the damper",
    forms=(
        Form(
            "rigid",
            "inertia",
            (Quantity("mass", "kg", 0.0, 1000.0, 2.0, "mass between load cell and damper"),),
            ((0.0,),),
            compute_inertia,
        ),
    ),
)
