"""Gas in the accumulator, compressed by the rod that enters the cylinder.

``polytropic``: with the rest length L of the gas column, force = -F_g ((1 + x/L)^-kappa - 1). It stiffens in
compression (x < 0). In a recording with reversed sign it stiffens the other way (``polytropic_reversed``).

``heat_exchange``: gas that is compressed fast warms up and loses its heat to the wall within a time constant
(Pourmovahed and Otis 1990, for accumulators). It is adiabatic in fast strokes, isothermal in slow ones, and has a
hysteresis loop in between. The compression is adiabatic from the volume at which the gas had the wall's
temperature, and that volume follows the actual one.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

KAPPA = 1.3
"""Polytropic exponent of nitrogen between isothermal (1) and adiabatic (1.4) [1]."""
GAMMA = 1.4
"""Heat capacity ratio of nitrogen [1]."""
_MIN_COLUMN = 0.02
"""Least fraction of the gas column [1]: the gas is not compressed further, so a search meets no infinite force."""


def compute_polytropic(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """Return the parallel force [N] at displacement x [m]; the velocity [m/s] has no influence."""
    return -preload * (np.maximum(1.0 + x / length, _MIN_COLUMN) ** -KAPPA - 1.0)


def compute_polytropic_reversed(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """Return the parallel force [N] with reversed sign: stiffening at positive displacement."""
    return preload * (np.maximum(1.0 - x / length, _MIN_COLUMN) ** -KAPPA - 1.0)


def compute_heat_exchange(
    x: Any, velocity: Any, followed: Any, preload: Any, length: Any, exchange_time: Any
) -> Any:
    """Return the parallel force [N] of gas that had the wall's temperature at displacement ``followed`` [m]."""
    volume = np.maximum(1.0 + x / length, _MIN_COLUMN)
    isothermal_volume = np.maximum(1.0 + followed / length, _MIN_COLUMN)
    return -preload * (volume**-GAMMA * isothermal_volume ** (GAMMA - 1.0) - 1.0)


def compute_heat_exchange_reversed(
    x: Any, velocity: Any, followed: Any, preload: Any, length: Any, exchange_time: Any
) -> Any:
    """Return the parallel force [N] of such gas with reversed sign."""
    volume = np.maximum(1.0 - x / length, _MIN_COLUMN)
    isothermal_volume = np.maximum(1.0 - followed / length, _MIN_COLUMN)
    return preload * (volume**-GAMMA * isothermal_volume ** (GAMMA - 1.0) - 1.0)


_PARAMETERS = (
    Quantity("preload", "N", 0.0, 5000.0, 90.0, "gas force at rest"),
    Quantity("length", "m", 0.005, 1.0, 0.05, "length of the gas column at rest"),
)
_STARTS = ((0.0, 0.025), (0.0, 0.06), (0.0, 0.2))
_EXCHANGE_TIME = Quantity(
    "exchange_time", "s", 0.02, 60.0, 0.5, "time constant with which the gas takes the wall's temperature"
)
_HEAT_EXCHANGE_STARTS = tuple((*start, exchange_time) for start in _STARTS[:2] for exchange_time in (0.1, 1.0))

GAS_SPRING = Effect(
    name="gas_spring",
    stage="damper",
    variable="displacement",
    meaning="the gas behind the piston pushes back more than a linear spring",
    forms=(
        Form("polytropic", "parallel_force", _PARAMETERS, _STARTS, compute_polytropic),
        Form("polytropic_reversed", "parallel_force", _PARAMETERS, _STARTS, compute_polytropic_reversed),
        Form(
            "heat_exchange",
            "relaxation_force",
            (*_PARAMETERS, _EXCHANGE_TIME),
            _HEAT_EXCHANGE_STARTS,
            compute_heat_exchange,
        ),
        Form(
            "heat_exchange_reversed",
            "relaxation_force",
            (*_PARAMETERS, _EXCHANGE_TIME),
            _HEAT_EXCHANGE_STARTS,
            compute_heat_exchange_reversed,
        ),
    ),
)
