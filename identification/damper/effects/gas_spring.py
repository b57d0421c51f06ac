"""Gas in the accumulator, compressed by the rod that enters the cylinder.

A polytropic spring about its rest length L: force = -F_g ((1 + x/L)^-kappa - 1). It stiffens in compression
(x < 0); in a recording with the sense turned round it stiffens the other way.

Gas that is compressed fast is warm, and gives its heat to the wall within a time constant (Pourmovahed and
Otis 1990, for accumulators): adiabatic in fast strokes, isothermal in slow ones, with a loop of its own
between. It is compressed adiabatically from a volume at which it had the wall's temperature, and that volume
follows the real one.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

KAPPA = 1.3
"""[1] polytropic exponent of nitrogen between isothermal (1) and adiabatic (1.4)."""
GAMMA = 1.4
"""[1] ratio of nitrogen's heat capacities."""
_SHORTEST = 0.02
"""[1] part of the column below which the gas is not compressed further: keeps any search finite."""


def compressed(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """Force [N] beside the law at displacement x [m]; the velocity [m/s] plays no part."""
    return -preload * (np.maximum(1.0 + x / length, _SHORTEST) ** -KAPPA - 1.0)


def turned(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """The same with the sense turned round: stiffening at positive displacement."""
    return preload * (np.maximum(1.0 - x / length, _SHORTEST) ** -KAPPA - 1.0)


def cooled(x: Any, velocity: Any, followed: Any, preload: Any, length: Any, exchange: Any) -> Any:
    """Force [N] of gas that had the wall's temperature at the displacement that follows [m]."""
    volume = np.maximum(1.0 + x / length, _SHORTEST)
    as_warm = np.maximum(1.0 + followed / length, _SHORTEST)
    return -preload * (volume**-GAMMA * as_warm ** (GAMMA - 1.0) - 1.0)


def cooled_turned(x: Any, velocity: Any, followed: Any, preload: Any, length: Any, exchange: Any) -> Any:
    """The same with the sense turned round."""
    volume = np.maximum(1.0 - x / length, _SHORTEST)
    as_warm = np.maximum(1.0 - followed / length, _SHORTEST)
    return preload * (volume**-GAMMA * as_warm ** (GAMMA - 1.0) - 1.0)


_PARAMETERS = (
    Quantity("preload", "N", 0.0, 5000.0, 90.0, "gas force at rest"),
    Quantity("length", "m", 0.005, 1.0, 0.05, "length of the gas column at rest"),
)
_STARTS = ((0.0, 0.025), (0.0, 0.06), (0.0, 0.2))
_EXCHANGE = Quantity(
    "exchange", "s", 0.02, 60.0, 0.5, "time constant with which the gas takes the wall's temperature"
)
_COOLED = tuple((*start, exchange) for start in _STARTS[:2] for exchange in (0.1, 1.0))

GAS_SPRING = Effect(
    name="gas_spring",
    stage="damper",
    meaning="the gas behind the piston pushes back more than a straight spring",
    forms=(
        Form("polytropic", "parallel_force", _PARAMETERS, _STARTS, compressed),
        Form("polytropic_turned", "parallel_force", _PARAMETERS, _STARTS, turned),
        Form("heat_to_wall", "relaxing_force", (*_PARAMETERS, _EXCHANGE), _COOLED, cooled),
        Form("heat_to_wall_turned", "relaxing_force", (*_PARAMETERS, _EXCHANGE), _COOLED, cooled_turned),
    ),
)
