"""Heating of the oil: the damper softens with the energy that it has dissipated.

The energy leaves the damper with a time constant. The energy E that remains softens it by the factor 1 / (1 + s
E). The yield force of the particles falls less with temperature than the viscosity of the oil. It does not fall
(``viscosity_only``), falls as much (``uniform``), or in part (``partial``).
"""

from typing import Any

from identification.damper.damper_size import SLOW_TIME
from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def soften_viscosity(energy: Any, softening: Any, recovery_time: Any) -> Any:
    """Return factors [1] on alpha, c0 and c1 at an energy [J] where only the oil becomes thinner."""
    factor = 1.0 / (1.0 + softening * energy)
    return factor**0, factor, factor


def soften_uniformly(energy: Any, softening: Any, recovery_time: Any) -> Any:
    """Return the factors [1] where the yield force falls with the viscosity."""
    factor = 1.0 / (1.0 + softening * energy)
    return factor, factor, factor


def soften_partially(energy: Any, softening: Any, recovery_time: Any, yield_exponent: Any) -> Any:
    """Return the factors [1] where the yield force falls with a power of the viscosity."""
    factor = 1.0 / (1.0 + softening * energy)
    return factor**yield_exponent, factor, factor


_PARAMETERS = (
    Quantity("softening", "1/J", 0.0, 0.1, 2e-4, "loss per joule in the damper", f"s/(N m {SLOW_TIME})"),
    Quantity("recovery_time", "s", 2.0, 1e4, 100.0, "time constant with which the heat leaves", SLOW_TIME),
)
_YIELD_EXPONENT = Quantity(
    "yield_exponent", "1", 0.05, 1.0, 0.5, "power with which the yield force follows the viscosity"
)
_STARTS = ((0.0, 15.0), (0.0, 60.0), (0.0, 400.0))

VISCOUS_HEATING = Effect(
    name="viscous_heating",
    stage="damper",
    variable="dissipated_energy",
    meaning="the damper softens with the heat that it has produced",
    forms=(
        Form("viscosity_only", "softening", _PARAMETERS, _STARTS, soften_viscosity),
        Form("uniform", "softening", _PARAMETERS, _STARTS, soften_uniformly),
        Form(
            "partial",
            "softening",
            (*_PARAMETERS, _YIELD_EXPONENT),
            tuple((*start, 0.5) for start in _STARTS),
            soften_partially,
        ),
    ),
)
