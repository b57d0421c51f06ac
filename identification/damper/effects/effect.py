"""What an effect is: one unmodelled thing that a real bench may add to the law.

The stages of the chain, in order: drive -> [coil] -> [damper] <-> [mounting] -> [force_channel] -> recorded
force; displacement at the actuator -> [displacement_channel] -> recorded displacement. Every effect acts at
one place of it. Which effects are at work today, and how strongly, is never said here but in a scenario.

One cause can look in several ways: each is a form with parameters of its own. A form is a plain function of
numbers. Those without memory are written in numpy's elementary functions, so that floats, arrays and compiled
code all take them; those with memory take and give floats.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from identification.damper.parameters import Quantity

Stage = Literal["coil", "damper", "mounting", "force_channel", "displacement_channel"]
Action = Literal[
    "drive_delay",
    "field",
    "field_memory",
    "scaling",
    "softening",
    "parallel_force",
    "dragging_force",
    "relaxing_force",
    "displacement_follower",
    "connection",
    "inertia",
    "time_shift",
    "force_lag",
    "added_force",
    "displacement_map",
    "displacement_shift",
]
"""How a form acts, and what its function takes before the values of the parameters, and gives:

- ``drive_delay``: () -> dead time [s], time constant of a second lag [s], part of the field behind that lag [1],
  and how many such lags there are in a row [1], one or two.
- ``field``: field [drive] -> field that the damper sees [drive].
- ``field_memory``: field, remembered [drive] -> field that the damper sees; with ``memory`` over (remembered,
  change of the field), which never depends on how a change in one sense is cut.
- ``scaling``: displacement [m], velocity [m/s] -> factors of alpha, c0, c1.
- ``softening``: energy [J] -> factors of alpha, c0, c1. The energy is that which the damper has dissipated and
  not yet given away: it leaves with the time constant ``recovery`` among the parameters [s].
- ``parallel_force``: displacement, velocity of the damper -> force beside the law [N].
- ``dragging_force``: displacement, velocity of the damper, remembered [1] -> force beside the law [N]; with
  ``memory`` over (remembered, change of the displacement), which never depends on how a change is cut.
- ``relaxing_force``: displacement, velocity of the damper, displacement that follows it with the time constant
  ``exchange`` among the parameters [s] -> force beside the law [N].
- ``displacement_follower``: where the damper stood, where the actuator is [m] -> where the damper stands [m].
- ``connection``: () -> give [m/N], gap [m], hardening [1/m²] and film [N s/m] of what carries the damper, and
  stiffness inside the gap over that outside [1]; those of several add up.
- ``inertia``: acceleration of the actuator [m/s^2] -> force between load cell and damper [N].
- ``time_shift``: () -> time by which the force channel is late [s].
- ``force_lag``: () -> time constant of a lag in the force channel [s].
- ``added_force``: time since the start of the run [s], drive -> force that the channel adds [N].
- ``displacement_map``: displacement -> what the channel adds to it [m].
- ``displacement_shift``: () -> time by which the displacement channel is late [s].
"""


class Form(NamedTuple):
    """One way in which an effect may look."""

    name: str
    """Name in documents."""
    acts: Action
    """How."""
    parameters: tuple[Quantity, ...]
    """Its parameters, in the order in which the function takes them."""
    starts: tuple[tuple[float, ...], ...]
    """Values worth trying first, in a search."""
    act: Callable[..., Any]
    """The form as a plain function: its arguments follow from ``acts``."""
    memory: Callable[..., Any] | None = None
    """What is remembered after a change, of forms with memory."""


class Effect(NamedTuple):
    """One effect: its name in documents, its place in the chain and its forms."""

    name: str
    """Name in documents."""
    stage: Stage
    """Its place in the chain."""
    meaning: str
    """One line for a person."""
    forms: tuple[Form, ...]
    """The usual one first."""

    def form(self, name: str | None = None) -> Form:
        """The form of a name, or the usual one.

        Raises:
            KeyError: there is no such form.
        """
        if name is None:
            return self.forms[0]
        return {form.name: form for form in self.forms}[name]
