"""Effect: one physical cause that a real bench adds to the law.

The stages of the chain, in order: drive -> [coil] -> [damper] <-> [mounting] -> [force_channel] -> recorded force;
displacement at the actuator -> [displacement_channel] -> recorded displacement. An effect acts at one stage. A
scenario or a fit names the effects that are active, and the values of their parameters.

An effect has one or more functional forms, each with its own parameters. The function of a form without memory
uses numpy's elementary functions only, so it takes floats, arrays, compiled numbers and dual numbers. One with
memory takes floats.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, get_args

from identification.damper.effects.former_names import rename_form
from identification.damper.parameters import Quantity

Stage = Literal["coil", "damper", "mounting", "force_channel", "displacement_channel"]
STAGES: tuple[Stage, ...] = get_args(Stage)
"""Stages of the signal chain, in their order."""
Place = Literal[
    "drive", "field", "damper_gain", "parallel_force", "mounting", "force_channel", "displacement_channel"
]
"""Place in the chain at which an effect acts; it is finer than the stage."""
Variable = Literal[
    "displacement",
    "velocity",
    "acceleration",
    "travel_since_reversal",
    "travel_since_rest",
    "force",
    "drive",
    "drive_history",
    "temperature",
    "time",
    "dissipated_energy",
]
"""Variable on which an effect depends."""
Action = Literal[
    "drive_delay",
    "drive_response",
    "field",
    "field_memory",
    "scaling",
    "softening",
    "parallel_force",
    "hysteretic_force",
    "relaxation_force",
    "displacement_backlash",
    "connection",
    "elongation_function",
    "inertia",
    "time_shift",
    "force_lag",
    "additive_force",
    "displacement_map",
    "displacement_shift",
    "drive_function",
    "field_function",
    "gain_function",
    "force_function",
    "mount_function",
    "channel_function",
    "channel_response",
    "displacement_function",
]
"""Quantity on which a form acts. It fixes the function's result and its arguments before the parameters:

- ``drive_delay``: () -> dead time [s], time constant of a second lag [s], fraction of the field behind that lag
  [1], and number of such lags in series [1], one or two.
- ``field``: field [drive] -> field that the damper sees [drive].
- ``field_memory``: field, mean of the form's memories -> field that the damper sees [drive]; ``memory``: (memory,
  change of the field, position of this memory among all in 0..1) -> memory, the same however a monotonic change is
  divided. Memories begin at zero and take the change to the first field, which is ``initial_rise`` [1] among the
  parameters times that field.
- ``scaling``: displacement [m], velocity [m/s] -> factors on alpha, c0, c1.
- ``softening``: energy [J] -> factors on alpha, c0, c1. The energy is what the damper has dissipated and not yet
  lost: it leaves with the time constant ``recovery_time`` [s] among the parameters.
- ``parallel_force``: displacement, velocity of the damper -> force that adds to the law's [N].
- ``hysteretic_force``: displacement, velocity of the damper, memory [1] -> force that adds to the law's [N];
  ``memory``: (memory, change of the displacement, velocity) -> memory, at one velocity the same however a
  monotonic change is divided.
- ``relaxation_force``: displacement, velocity of the damper, displacement that follows with the time constant
  ``exchange_time`` [s] among the parameters -> force that adds to the law's [N].
- ``displacement_backlash``: previous displacement of the damper, displacement of the actuator [m] -> displacement
  of the damper [m].
- ``connection``: () -> compliance [m/N], gap [m], hardening [1/m²] and film damping [N s/m] of the connection
  between load cell and damper, and its in-gap stiffness ratio [1]. Those of several effects add up.
- ``elongation_function``: force of the connection by name -> elongation that it adds [m].
- ``inertia``: acceleration of the actuator [m/s²] -> force between load cell and damper [N].
- ``time_shift``: () -> delay of the force channel [s].
- ``force_lag``: () -> time constant of a lag in the force channel [s].
- ``additive_force``: time since the start of the run [s], drive -> force that the channel adds [N].
- ``displacement_map``: displacement -> error that the channel adds to it [m].
- ``displacement_shift``: () -> delay of the displacement channel [s].
- ``drive_function``, ``field_function``, ``gain_function``, ``force_function``, ``mount_function``,
  ``channel_function``, ``displacement_function``: variables by name -> value at the place, as in
  `identification.damper.definitions`.
- ``drive_response``, ``channel_response``: time since a change of the drive or force by name -> part of the change
  that has arrived [1].
"""

PLACES: dict[Action, Place] = {
    "drive_delay": "drive",
    "drive_response": "drive",
    "field": "field",
    "field_memory": "field",
    "scaling": "damper_gain",
    "softening": "damper_gain",
    "parallel_force": "parallel_force",
    "hysteretic_force": "parallel_force",
    "relaxation_force": "parallel_force",
    "displacement_backlash": "mounting",
    "connection": "mounting",
    "elongation_function": "mounting",
    "inertia": "mounting",
    "time_shift": "force_channel",
    "force_lag": "force_channel",
    "additive_force": "force_channel",
    "displacement_map": "displacement_channel",
    "displacement_shift": "displacement_channel",
    "drive_function": "drive",
    "field_function": "field",
    "gain_function": "damper_gain",
    "force_function": "parallel_force",
    "mount_function": "mounting",
    "channel_function": "force_channel",
    "channel_response": "force_channel",
    "displacement_function": "displacement_channel",
}
"""Place of each action."""


class Form(NamedTuple):
    """Functional form of an effect."""

    name: str
    """Name in documents."""
    action: Action
    """Quantity on which the form acts."""
    parameters: tuple[Quantity, ...]
    """Its parameters, in the order in which the function takes them."""
    starts: tuple[tuple[float, ...], ...]
    """Starting values for a search, the most promising first."""
    function: Callable[..., Any]
    """The form as a plain function; its arguments follow from ``action``."""
    memory: Callable[..., Any] | None = None
    """Function that updates the memory after a change; None for forms without memory."""
    memories: int = 1
    """Number of memories of a form with the action ``field_memory``; other forms have at most one."""

    @property
    def place(self) -> Place:
        """Place in the chain at which the form acts."""
        return PLACES[self.action]

    def name_values(self, values: Sequence[float]) -> dict[str, float]:
        """Return the values of its parameters, in their order, by symbol."""
        return dict(zip((q.symbol for q in self.parameters), values, strict=True))


class Effect(NamedTuple):
    """An effect: its name in documents, its stage in the chain and its forms."""

    name: str
    """Name in documents."""
    stage: Stage
    """Stage of the chain at which it acts."""
    variable: Variable
    """Variable on which it depends most."""
    meaning: str
    """Description for a person, one line."""
    forms: tuple[Form, ...]
    """Its functional forms, the usual one first."""

    def find_form(self, name: str | None = None) -> Form:
        """Return the form of a present or former name, or the usual form.

        Raises:
            KeyError: the effect has no such form.
        """
        if name is None:
            return self.forms[0]
        return {form.name: form for form in self.forms}[rename_form(self.name, name)]
