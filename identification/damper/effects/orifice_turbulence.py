"""Flow that turns turbulent in the orifice: a pressure drop that grows faster than the velocity.

force = q v |v|; or, where the flow is between laminar and turbulent, another power of the speed.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

REFERENCE = 0.1
"""[m/s] speed at which the second form gives its force."""


def quadratic(x: Any, velocity: Any, coefficient: Any) -> Any:
    """Force [N] beside the law at velocity [m/s]; the displacement [m] plays no part."""
    return coefficient * velocity * np.abs(velocity)


def power(x: Any, velocity: Any, force: Any, exponent: Any) -> Any:
    """Force [N] beside the law that grows with a power of the speed; ``force`` [N] is that at 0.1 m/s."""
    return force * np.sign(velocity) * (np.abs(velocity) / REFERENCE) ** exponent


ORIFICE_TURBULENCE = Effect(
    name="orifice_turbulence",
    stage="damper",
    meaning="the flow turns turbulent, so the damping grows with the speed",
    forms=(
        Form(
            "quadratic",
            "parallel_force",
            (Quantity("coefficient", "N s^2/m^2", 0.0, 1e6, 1000.0, "force over the square of the velocity"),),
            ((0.0,),),
            quadratic,
        ),
        Form(
            "power",
            "parallel_force",
            (
                Quantity("force", "N", 0.0, 5000.0, 10.0, "force at 0.1 m/s"),
                Quantity("exponent", "1", 1.2, 3.5, 2.0, "power of the speed"),
            ),
            ((0.0, 1.75), (0.0, 2.5)),
            power,
        ),
    ),
)
