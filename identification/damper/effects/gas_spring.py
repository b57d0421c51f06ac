"""Gas in the accumulator, compressed by the rod that enters the cylinder.

A polytropic spring about its rest length L: force = -F_g ((1 + x/L)^-kappa - 1). It stiffens in compression
(x < 0); in a recording with the sense turned round it stiffens the other way.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

KAPPA = 1.3
"""[1] polytropic exponent of nitrogen between isothermal (1) and adiabatic (1.4)."""
_SHORTEST = 0.02
"""[1] part of the column below which the gas is not compressed further: keeps any search finite."""


def compressed(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """Force [N] beside the law at displacement x [m]; the velocity [m/s] plays no part."""
    return -preload * (np.maximum(1.0 + x / length, _SHORTEST) ** -KAPPA - 1.0)


def turned(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """The same with the sense turned round: stiffening at positive displacement."""
    return preload * (np.maximum(1.0 - x / length, _SHORTEST) ** -KAPPA - 1.0)


_PARAMETERS = (
    Quantity("preload", "N", 0.0, 5000.0, 90.0, "gas force at rest"),
    Quantity("length", "m", 0.005, 1.0, 0.05, "length of the gas column at rest"),
)
_STARTS = ((0.0, 0.025), (0.0, 0.06), (0.0, 0.2))

GAS_SPRING = Effect(
    name="gas_spring",
    stage="damper",
    meaning="the gas behind the piston pushes back more than a straight spring",
    forms=(
        Form("polytropic", "parallel_force", _PARAMETERS, _STARTS, compressed),
        Form("polytropic_turned", "parallel_force", _PARAMETERS, _STARTS, turned),
    ),
)
