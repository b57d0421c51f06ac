"""Gas in the accumulator, compressed by the rod that enters the cylinder.

A polytropic spring about its rest length L: force = -F_g ((1 + x/L)^-kappa - 1). It stiffens in compression
(x < 0). A recording with the sense turned round is the same form with F_g and L both negative.
"""

from typing import Any

from identification.damper.effects.effect import Effect
from identification.damper.parameters import Quantity

KAPPA = 1.3
"""[1] polytropic exponent of nitrogen between isothermal (1) and adiabatic (1.4)."""


def force(x: Any, velocity: Any, preload: Any, length: Any) -> Any:
    """Force [N] beside the law at displacement x [m]; the velocity [m/s] plays no part."""
    return -preload * ((1 + x / length) ** -KAPPA - 1)


def slopes(x: Any, velocity: Any, preload: Any, length: Any) -> tuple[Any, Any, Any, Any]:
    """Slopes of the force over x [N/m], velocity [N s/m], preload [1] and length [N/m]."""
    ratio = 1 + x / length
    steep = preload * KAPPA * ratio ** (-KAPPA - 1)
    return steep / length, 0 * x, 1 - ratio**-KAPPA, -steep * x / length**2


GAS_SPRING = Effect(
    name="gas_spring",
    stage="damper",
    acts="parallel_force",
    form="polytropic",
    parameters=(
        Quantity("preload", "N", -2000.0, 2000.0, 90.0, "gas force at rest"),
        Quantity("length", "m", 0.005, 1.0, 0.05, "length of the gas column at rest"),
    ),
    meaning="the gas behind the piston pushes back more than a straight spring",
    act=force,
    slopes=slopes,
)
