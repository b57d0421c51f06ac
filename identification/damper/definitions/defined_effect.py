"""Defined effects: effects whose function comes from a definition and not from the library.

The value of the function acts at the definition's place:

- ``drive``, ``field``: adds to the drive before the coil's lag, or to the field behind it [drive].
- ``damper_gain``: the factor on alpha, c0 and c1 is one plus the value [1].
- ``parallel_force``: adds to the law's force [N].
- ``mounting``: adds to the force between load cell and damper [N]. A function of that force is the elongation of
  their connection instead [m], which grows with the force: the damper moves less than the actuator.
- ``force_channel``: adds to the recorded force [N].
- ``displacement_channel``: adds to the recorded displacement [m].

A step response at ``drive`` or ``force_channel`` is no such value. It is the part [1] of a change of the drive or
force that has arrived, over the time since the change.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.damper.definitions.effect_file import EffectFile, EffectParameter, FunctionKind, is_elongation
from identification.damper.definitions.expression import Expression
from identification.damper.effects import Action, Effect, Form, Place, Variable
from identification.damper.parameters import Quantity

CURVE = "curve"
"""Name by which an expression refers to the curve of its file."""
DEFINED_FORM = "defined"
"""Name of the only form of a defined effect."""
ACTIONS: dict[Place, Action] = {
    "drive": "drive_function",
    "field": "field_function",
    "damper_gain": "gain_function",
    "parallel_force": "force_function",
    "mounting": "mount_function",
    "force_channel": "channel_function",
    "displacement_channel": "displacement_function",
}
"""Action of a value at each place, except for a function of the force in the mounting."""
_RESPONSE_ACTIONS: dict[Place, Action] = {"drive": "drive_response", "force_channel": "channel_response"}
"""Action of a step response at each place that has one."""
DEFINED_ACTIONS: frozenset[Action] = frozenset(
    {*ACTIONS.values(), *_RESPONSE_ACTIONS.values(), "elongation_function"}
)
"""All actions of defined effects."""


@dataclass(frozen=True)
class DefinedFunction:
    """Function of a defined effect; hashable, and it can be sent to another process."""

    variables: tuple[str, ...]
    """Names of the variables on which the expression depends."""
    expression: Expression
    symbols: tuple[str, ...]
    """Names of the parameters, in their order."""
    curve_variable: str = ""
    """Variable of the curve; empty without one."""
    curve_positions: tuple[float, ...] = ()
    """Values of that variable at which the curve is given, increasing."""
    curve_values: tuple[float, ...] = ()
    """Values of the curve there; it is constant beyond its ends."""
    document: str = ""
    """The effect file as JSON, from which the effect can be made again."""

    def __call__(self, variables: Mapping[str, Any], *values: Any) -> Any:
        """Return the value (N,) for variables (N,) each and values of the parameters."""
        known = {name: variables[name] for name in self.variables}
        known.update(zip(self.symbols, values, strict=True))
        if self.curve_variable:
            known[CURVE] = np.interp(known[self.curve_variable], self.curve_positions, self.curve_values)
        return self.expression.evaluate(known) + 0.0 * known[self.variables[0]]


def find_action(place: Place, variables: Sequence[Variable], kind: FunctionKind = "value") -> Action:
    """Return the action of a defined effect of a kind at a place, over some variables."""
    if kind == "step_response":
        return _RESPONSE_ACTIONS[place]
    return "elongation_function" if is_elongation(place, variables) else ACTIONS[place]


def make_effect(file: EffectFile) -> Effect:
    """Return the effect that a file defines."""
    quantities = tuple(
        Quantity(symbol, p.unit, p.lo, p.hi, _find_scale(p), "of the definition", scaling="1")
        for symbol, p in file.parameters.items()
    )  # scaling: the bounds of a file are those of the user's damper, whatever its size
    expression = Expression.parse(file.expression or CURVE)
    curve = file.curve
    function = DefinedFunction(
        tuple(file.arguments),
        expression,
        tuple(file.parameters),
        curve.variable if curve else "",
        tuple(curve.x) if curve else (),
        tuple(curve.value) if curve else (),
        file.model_dump_json(by_alias=True),
    )
    start = tuple(p.value for p in file.parameters.values())
    form = Form(DEFINED_FORM, find_action(file.place, file.variables, file.kind), quantities, (start,), function)
    return Effect(file.name, file.stage, file.variables[0], file.describe(), (form,))


def find_effect_file(effect: Effect) -> EffectFile | None:
    """Return the file that defines an effect; None for an effect of the library."""
    function = effect.forms[0].function
    return EffectFile.model_validate_json(function.document) if isinstance(function, DefinedFunction) else None


def _find_scale(parameter: EffectParameter) -> float:
    return abs(parameter.value) or max(abs(parameter.lo), abs(parameter.hi)) or 1.0
