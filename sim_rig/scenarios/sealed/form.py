"""What a sealed form is: an effect as the trial plays it, in other words than the library's.

Every form is one plain function ``act(now, memory, values, rate)`` of one step of the motion. It reads what holds
``now``, writes the ``rate`` of each of its own states in ``memory``, and returns what its place asks for.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Literal, NamedTuple

from identification.damper.parameters import Quantity

Stage = Literal["coil", "damper", "mounting", "force_channel", "displacement_channel"]

MEMORY = 4
"""States that a form may have."""
VALUES = 6
"""Parameters that a form may have."""

NOW = 12
"""What a form may look at, in the order of the names below."""
(
    TIME,  # [s] since the start of the run
    X,  # [m] displacement of the damper
    V,  # [m/s] its velocity
    ACCELERATION,  # [m/s²] of the actuator
    FIELD,  # [V or A] behind the coil
    FIELD_RATE,  # [V/s or A/s]
    OUTPUT,  # [V or A] of the amplifier
    FORCE,  # [N] on the load cell, as far as it is known at the form's place
    POWER,  # [W] that the damper turns into heat
    PATH,  # [m] that the damper has travelled, to and fro
    STRETCH,  # [m] by which the damper is behind the actuator
    STRETCH_RATE,  # [m/s]
) = range(NOW)


class Place(IntEnum):
    """Where a form acts, and what it returns."""

    NOWHERE = 0
    COIL = 1
    """The field [V or A] that the damper feels."""
    SCALE = 2
    """A positive factor [1] on the damper's strength; ``weights`` are its powers on alpha, c0 and c1."""
    PARALLEL = 3
    """A force beside the law [N]."""
    CONNECTION = 4
    """The force [N] that the connection carries at a stretch and a stretch rate."""
    CELL = 5
    """A force that the load cell feels beside the damper's [N]."""
    CHANNEL = 6
    """What the force channel makes of the force [N]."""
    POSITION = 7
    """What the displacement channel makes of the displacement [m]."""


Act = Callable[[Any, Any, Any, Any], float]


def at_ease(*values: float) -> float:
    """Fastest rate [1/s] of a form without a motion of its own."""
    return 0.0


class Form(NamedTuple):
    """One effect in one sealed form."""

    effect: str
    """Name of the effect: one of the library's, or one that the library does not know."""
    form: str
    """Name of the functional form, unique."""
    stage: Stage
    """Its place in the chain."""
    place: Place
    """What its function returns."""
    parameters: tuple[Quantity, ...]
    """In the order of ``values``; the first is the size, and at zero nothing happens."""
    meaning: str
    """One line for a person."""
    act: Act
    """The form."""
    fastest: Callable[..., float] = at_ease
    """Over the values: its fastest rate [1/s], which the integrator has to follow."""
    weights: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Powers of a scale on alpha, c0 and c1 [1]."""
    known: bool = True
    """Whether the library is to know an effect of this name."""
