"""What an effect is: one unmodelled thing that a real bench may add to the law.

The stages of the chain, in order: drive -> [coil] -> [damper] <-> [mounting] -> [force_channel] -> recorded
force; displacement at the actuator -> [displacement_channel] -> recorded displacement. Every effect acts at
one place of it. Which effects are at work today, and how strongly, is never said here but in a scenario.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from identification.damper.parameters import Quantity

Stage = Literal["coil", "damper", "mounting", "force_channel", "displacement_channel"]
Action = Literal["parallel_force", "displacement_follower", "time_shift"]


class Effect(NamedTuple):
    """One effect: its name in documents, its place in the chain and its form."""

    name: str
    """Name in documents."""
    stage: Stage
    """Its place in the chain."""
    acts: Action
    """How: a force beside the law, a displacement that follows another, or a channel that comes late."""
    form: str
    """Name of the functional form."""
    parameters: tuple[Quantity, ...]
    """Its parameters, in the order in which the functions take them."""
    meaning: str
    """One line for a person."""
    act: Callable[..., Any]
    """The form as a plain function: its arguments follow from ``acts``."""
    slopes: Callable[..., Any]
    """Partial derivatives of ``act``, in the order of its arguments."""
