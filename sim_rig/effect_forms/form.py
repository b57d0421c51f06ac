"""Alternative forms: effects of the blind trial in other functional forms than those of the library.

Every form is one function ``f(now, memory, values, rate)``, evaluated at each stage of an integration step.
``now`` contains the inputs below, ``memory`` the form's own states and ``values`` its parameters. The function
writes the derivative of each state to ``rate`` and returns the quantity that its place requires.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Any, NamedTuple

from identification.damper import Quantity
from identification.damper.effects import Stage

MAX_STATES = 4
"""Largest number of states of a form."""
MAX_PARAMETERS = 6
"""Largest number of parameters of a form."""

INPUT_COUNT = 12
"""Inputs of a form, in the order of the names below."""
(
    TIME,  # [s] since the start of the run
    X,  # [m] displacement of the damper
    V,  # [m/s] its velocity
    ACCELERATION,  # [m/s²] of the actuator
    FIELD,  # [V or A] that the fluid sees
    FIELD_RATE,  # [V/s or A/s]
    OUTPUT,  # [V or A] of the amplifier
    FORCE,  # [N] on the load cell, as computed up to the form's place
    POWER,  # [W] dissipated by the damper
    PATH,  # [m] travelled by the damper, both directions added
    ELONGATION,  # [m] displacement of the actuator minus that of the damper
    ELONGATION_RATE,  # [m/s]
) = range(INPUT_COUNT)


class Place(IntEnum):
    """Place in the chain at which a form acts; it defines what the form's function returns."""

    NONE = 0
    FIELD = 1
    """Field [V or A] that the fluid sees."""
    DAMPER_GAIN = 2
    """Positive factor [1] on the damper's strength; ``exponents`` are its powers on alpha, c0 and c1."""
    PARALLEL_FORCE = 3
    """Force [N] that adds to that of the law."""
    MOUNTING = 4
    """Force [N] that the mounting transmits at an elongation and an elongation rate."""
    LOAD_CELL_FORCE = 5
    """Force [N] on the load cell in addition to the damper's."""
    FORCE_CHANNEL = 6
    """Force [N] that the force channel outputs."""
    DISPLACEMENT_CHANNEL = 7
    """Displacement [m] that the displacement channel outputs."""


FormFunction = Callable[[Any, Any, Any, Any], float]


def return_zero_rate(*values: float) -> float:
    """Return the fastest rate [1/s] of a form without fast states: zero."""
    return 0.0


class AlternativeForm(NamedTuple):
    """One effect in one alternative form."""

    effect: str
    """Name of the effect, in the library or unknown to it."""
    form: str
    """Name of the functional form, unique."""
    stage: Stage
    """Stage of the measurement chain, as a diagnosis names it."""
    place: Place
    """Place at which it acts."""
    parameters: tuple[Quantity, ...]
    """In the order of ``values``; the first is the size, and at size zero the form has no influence."""
    meaning: str
    """One line for a person."""
    function: FormFunction
    """Function of one integration stage, see the module."""
    max_rate: Callable[..., float] = return_zero_rate
    """Fastest rate [1/s] for the parameter values; it bounds the integration step."""
    exponents: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Powers [1] of a damper gain on alpha, c0 and c1."""
    in_library: bool = True
    """True if the library has an effect of this name."""
    former_symbols: Mapping[str, str] = MappingProxyType({})
    """Former parameter symbol -> present one, for scenarios and sealed truths of earlier trials."""
