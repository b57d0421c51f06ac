"""Oil that gets thinner as it warms: the damper softens with the energy that it has dissipated.

The energy leaves to the room with a time constant. What is left of it softens: factor 1 / (1 + s E). The yield
force of the particles falls less with the temperature than the viscosity of the oil: not at all, as much, or in
part.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def viscosity(energy: Any, softening: Any, recovery: Any) -> Any:
    """Factors [1] of alpha, c0 and c1 at the energy [J] in the damper: the oil alone gets thinner."""
    left = 1.0 / (1.0 + softening * energy)
    return left**0, left, left


def whole(energy: Any, softening: Any, recovery: Any) -> Any:
    """The same where the yield force falls with the viscosity."""
    left = 1.0 / (1.0 + softening * energy)
    return left, left, left


def partly(energy: Any, softening: Any, recovery: Any, part: Any) -> Any:
    """The same where the yield force falls with a power of the viscosity."""
    left = 1.0 / (1.0 + softening * energy)
    return left**part, left, left


_PARAMETERS = (
    Quantity("softening", "1/J", 0.0, 0.1, 2e-4, "loss for each joule in the damper"),
    Quantity("recovery", "s", 2.0, 1e4, 100.0, "time constant with which the heat leaves"),
)
_PART = Quantity("part", "1", 0.05, 1.0, 0.5, "power with which the yield force follows the viscosity")
_STARTS = ((0.0, 15.0), (0.0, 60.0), (0.0, 400.0))

VISCOUS_HEATING = Effect(
    name="viscous_heating",
    stage="damper",
    meaning="the damper softens with the heat that it has made",
    forms=(
        Form("viscosity", "softening", _PARAMETERS, _STARTS, viscosity),
        Form("whole", "softening", _PARAMETERS, _STARTS, whole),
        Form("partly", "softening", (*_PARAMETERS, _PART), tuple((*start, 0.5) for start in _STARTS), partly),
    ),
)
