"""Turbulent flow in the orifice: a pressure drop that grows faster than the velocity.

force = q v |v|. Between laminar and turbulent flow the force follows another power of the speed.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

REFERENCE_SPEED = 0.1
"""Speed at which the form ``power`` has its force [m/s]."""


def compute_quadratic_force(x: Any, velocity: Any, coefficient: Any) -> Any:
    """Return the parallel force [N] at a velocity [m/s]; the displacement [m] has no influence."""
    return coefficient * velocity * np.abs(velocity)


def compute_power_force(x: Any, velocity: Any, force: Any, exponent: Any) -> Any:
    """Return the parallel force [N] that grows with a power of the speed; ``force`` [N] holds at 0.1 m/s."""
    return force * np.sign(velocity) * (np.abs(velocity) / REFERENCE_SPEED) ** exponent


ORIFICE_TURBULENCE = Effect(
    name="orifice_turbulence",
    stage="damper",
    variable="velocity",
    meaning="the flow becomes turbulent, so the damping grows with the speed",
    forms=(
        Form(
            "quadratic",
            "parallel_force",
            (Quantity("coefficient", "N s^2/m^2", 0.0, 1e6, 1000.0, "force over the square of the velocity"),),
            ((0.0,),),
            compute_quadratic_force,
        ),
        Form(
            "power",
            "parallel_force",
            (
                Quantity("force", "N", 0.0, 5000.0, 10.0, "force at 0.1 m/s", "N s^2/m^2"),
                Quantity("exponent", "1", 1.2, 3.5, 2.0, "power of the speed"),
            ),
            ((0.0, 1.75), (0.0, 2.5)),
            compute_power_force,
        ),
    ),
)
