"""Defined effects of a scenario, translated into instructions of the compiled stack machine.

The effects of one place become one expression. Its value is the sum of their values; at the place of the damper's
gain, it is the product of their factors. All effects of a place depend on the same variables.
"""

import functools
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple, cast

import numpy as np

from identification.damper.definitions import CURVE, DefinedFunction, Instruction
from identification.damper.effects import Action
from sim_rig.plant.defined_effects.stack_machine import (
    FIELD_PLACE,
    FORCE_PLACE,
    GAIN_PLACE,
    MOUNTING_PLACE,
    OPCODES,
    DefinedFunctions,
    evaluate,
)
from sim_rig.plant.defined_effects.variables import (
    ACCELERATION,
    DISPLACEMENT,
    DISSIPATED_ENERGY,
    DRIVE,
    DRIVE_HISTORY,
    FIELD,
    FIELD_HISTORY,
    MEMORY_COUNT,
    TIME,
    TRAVEL_SINCE_REST,
    TRAVEL_SINCE_REVERSAL,
    VARIABLE_COUNT,
    VELOCITY,
)
from sim_rig.plant.effects import EffectFunctions, ParameterValues
from sim_rig.plant.jit import Array

_ACTIONS: tuple[Action, ...] = (
    "drive_function",
    "field_function",
    "gain_function",
    "force_function",
    "mount_function",
)
"""Action at each place of the plant."""
_VARIABLES = {
    "displacement": DISPLACEMENT,
    "velocity": VELOCITY,
    "acceleration": ACCELERATION,
    "travel_since_reversal": TRAVEL_SINCE_REVERSAL,
    "travel_since_rest": TRAVEL_SINCE_REST,
    "drive": DRIVE,
    "drive_history": DRIVE_HISTORY,
    "time": TIME,
    "dissipated_energy": DISSIPATED_ENERGY,
}
"""Index of each variable by its name in an effect file."""
_FIELD_VARIABLES = {"drive": FIELD, "drive_history": FIELD_HISTORY}
"""Variables that are those of the field at its place."""
_ACCELERATION_PASSES = 3
"""Evaluations per rate if a force depends on the acceleration, and so on itself: two, and one at their secant."""
_SLOPE_DRIVES = (0.0, 1.0)
"""[V or A] at which the slope of the forces over the velocity is determined."""

_Code = tuple[str, float]
"""Instruction and its operand as a number."""


class _Curve(NamedTuple):
    """Curve of one effect, over the variable with an index."""

    variable: int
    positions: tuple[float, ...]
    values: tuple[float, ...]


def make_defined_functions(effects: EffectFunctions) -> DefinedFunctions | None:
    """Return the functions of all defined effects in the plant, or None if there are none."""
    if not effects.select(*_ACTIONS, "drive_response"):
        return None
    curves: list[_Curve] = []
    places = [_translate_place(effects, place, curves) for place in range(len(_ACTIONS))]
    codes = [code for codes in places for code in codes]
    lengths = [len(curve.positions) for curve in curves]
    ends = np.cumsum(lengths, dtype=np.int64)
    return DefinedFunctions(
        bounds=np.cumsum([0, *(len(codes) for codes in places)], dtype=np.int64),
        codes=np.array([OPCODES.index(code) for code, _ in codes], np.int64),
        operands=np.array([operand for _, operand in codes], float),
        curves=np.array(
            [(c.variable, end - n, end) for c, n, end in zip(curves, lengths, ends, strict=True)], np.int64
        ).reshape(-1, 3),
        positions=np.array([x for curve in curves for x in curve.positions], float),
        values=np.array([value for curve in curves for value in curve.values], float),
        variables=np.zeros(VARIABLE_COUNT),
        memory=np.zeros(MEMORY_COUNT),
        stack=np.zeros(len(codes) + 1),  # an instruction pushes one value at most
        passes=_count_passes(codes, curves),
        weights=np.empty(0),
        window=np.empty(0),
    )


def set_drive_response(functions: DefinedFunctions, weights: Sequence[Array], drive: float) -> DefinedFunctions:
    """Return the functions with step responses of the drive, in series, that have settled at a drive [V or A].

    ``weights`` has those (L,) of each response.
    """
    if not weights:
        return functions
    whole = functools.reduce(np.convolve, weights)
    return functions._replace(weights=whole, window=np.full(len(whole), drive))


def compute_steepest_slope(functions: DefinedFunctions) -> float:
    """Return the largest slope of the forces over the velocity [N s/m], near rest; the variables are reset."""
    variables, steepest = functions.variables, 0.0
    for place, drive in product((FORCE_PLACE, MOUNTING_PLACE), _SLOPE_DRIVES):
        variables[DRIVE] = drive
        for speed in np.geomspace(1e-5, 1.0, 60):
            variables[VELOCITY] = 1.01 * speed
            above = evaluate(functions, place)
            variables[VELOCITY] = 0.99 * speed
            steepest = max(steepest, abs(above - evaluate(functions, place)) / (0.02 * speed))
    variables[:] = 0.0
    return steepest


def _count_passes(codes: Sequence[_Code], curves: Sequence[_Curve]) -> int:
    used = {int(operand) for code, operand in codes if code == "name"} | {curve.variable for curve in curves}
    return _ACCELERATION_PASSES if ACCELERATION in used else 1


def _translate_place(effects: EffectFunctions, place: int, curves: list[_Curve]) -> list[_Code]:
    """Return the instructions of all effects at a place, and add their curves to ``curves``."""
    gain = place == GAIN_PLACE
    codes: list[_Code] = [("number", 1.0 if gain else 0.0)]
    names = _VARIABLES | (_FIELD_VARIABLES if place == FIELD_PLACE else {})
    for form, values in effects.select(_ACTIONS[place]):
        own = _translate(cast(DefinedFunction, form.function), values, names, curves)
        codes += [("number", 1.0), *own, ("+", 0.0), ("*", 0.0)] if gain else [*own, ("+", 0.0)]
    return codes


def _translate(
    function: DefinedFunction, values: ParameterValues, names: dict[str, int], curves: list[_Curve]
) -> list[_Code]:
    """Return the instructions of one function, with the values of its parameters filled in."""
    known = dict(zip(function.symbols, values, strict=True))
    index = len(curves)
    if function.curve_variable:
        curves.append(_Curve(names[function.curve_variable], function.curve_positions, function.curve_values))
    return [_translate_instruction(i, names, known, index) for i in function.expression.instructions]


def _translate_instruction(
    instruction: Instruction, names: dict[str, int], values: dict[str, float], curve: int
) -> _Code:
    code, operand = instruction
    if code != "name":
        return code, float(operand)
    if operand == CURVE:
        return "curve", float(curve)
    if operand in values:
        return "number", float(values[str(operand)])
    return "name", float(names[str(operand)])
