"""Stack machine for the expressions of defined effects, in compiled code, one number at a time.

The results are those of `Expression.evaluate`, and those of `numpy.interp` for a curve.
"""

from typing import Any, NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from sim_rig.plant.jit import Array, compile_function

Indices = npt.NDArray[np.int64]

OPCODES = ("number", "name", "curve", "+", "-", "*", "/", "**", "abs", "sign", "exp", "log", "tanh", "sin")
"""Instructions in the order of their numbers: those that push a value, the operators and the functions."""
_NUMBER, _NAME, _CURVE, _ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _POWER, _ABS, _SIGN, _EXP, _LOG, _TANH, _SIN = range(
    len(OPCODES)
)
DRIVE_PLACE, FIELD_PLACE, GAIN_PLACE, FORCE_PLACE, MOUNTING_PLACE = range(5)
"""Places of the plant, by their index in ``DefinedFunctions.bounds``."""
# Limits as in `Expression.evaluate`.
_MAX_EXPONENT = 50.0
"""Largest argument of exp."""
_SMALLEST = 1e-12
"""Smallest size of a divisor and of a base with a negative exponent.

It is also the smallest argument of log and the smallest base with a fractional exponent.
"""


class DefinedFunctions(NamedTuple):
    """Functions of all defined effects in the plant, as compiled code takes them; one expression per place."""

    bounds: Indices
    """(P+1,) first instruction of each place, and the end of the last."""
    codes: Indices
    """(I,) instructions by their index in ``OPCODES``."""
    operands: Array
    """(I,) number, index of a variable, or index of a curve."""
    curves: Indices
    """(C, 3) variable, first point and end of each curve."""
    positions: Array
    """(Q,) values of the variables at the points of all curves."""
    values: Array
    """(Q,) values of the curves there."""
    variables: Array
    """(VARIABLE_COUNT,) variables now."""
    memory: Array
    """(MEMORY_COUNT,) memory from which variables of the past follow."""
    stack: Array
    """(D,) working space."""
    passes: int
    """Number of evaluations per rate: more than one if a function depends on the acceleration."""
    weights: Array
    """(L,) weights of the last drives in the step response of the drive, the newest first; empty without one."""
    window: Array
    """(L,) ring buffer of these drives [V or A]."""


_INDEX_VECTOR, _VECTOR = numba.int64[::1], numba.float64[::1]
_FIELD_TYPES = (
    _INDEX_VECTOR,
    _INDEX_VECTOR,
    _VECTOR,
    numba.int64[:, ::1],
    *[_VECTOR] * 5,
    numba.int64,
    _VECTOR,
    _VECTOR,
)
DEFINED_TYPE = numba.types.NamedTuple(_FIELD_TYPES, DefinedFunctions)  # type: ignore[no-untyped-call]
"""Type of ``DefinedFunctions`` in explicit signatures."""


@compile_function
def _interpolate(x: float, positions: Array, values: Array) -> float:
    """Return the value at x of a curve over increasing positions (N,); it is constant beyond its ends."""
    last = len(positions) - 1
    if x <= positions[0]:
        return float(values[0])
    if x >= positions[last]:
        return float(values[last])
    j = np.searchsorted(positions, x, side="right") - 1
    slope = (values[j + 1] - values[j]) / (positions[j + 1] - positions[j])
    return float(slope * (x - positions[j]) + values[j])


@compile_function
def _evaluate_curve(functions: Any, index: int) -> float:
    variable, first, end = functions.curves[index]
    return float(
        _interpolate(functions.variables[variable], functions.positions[first:end], functions.values[first:end])
    )


@compile_function
def _apply_function(code: int, value: float) -> float:
    if code == _ABS:
        return abs(value)
    if code == _SIGN:
        return float(np.sign(value))
    if code == _EXP:
        return float(np.exp(_MAX_EXPONENT if value > _MAX_EXPONENT else value))
    if code == _LOG:
        return float(np.log(_SMALLEST if value < _SMALLEST else value))
    return float(np.tanh(value) if code == _TANH else np.sin(value))


@compile_function
def _limit_magnitude(value: float) -> float:
    return _SMALLEST if abs(value) < _SMALLEST else value


@compile_function
def _raise_to_power(base: float, exponent: float) -> float:
    if exponent != np.round(exponent):
        # A negative base would have no real result.
        return float((_SMALLEST if base < _SMALLEST else base) ** exponent)
    return float((_limit_magnitude(base) if exponent < 0.0 else base) ** exponent)


@compile_function
def _apply_operator(code: int, left: float, right: float) -> float:
    if code == _ADD:
        return left + right
    if code == _SUBTRACT:
        return left - right
    if code == _MULTIPLY:
        return left * right
    return left / _limit_magnitude(right) if code == _DIVIDE else _raise_to_power(left, right)


@compile_function
def evaluate(functions: Any, place: int) -> float:
    """Return the result of the expression of a place for the present variables.

    Args:
        functions: `DefinedFunctions`; its stack is overwritten.
        place: index of the place in ``bounds``.
    """
    stack, depth = functions.stack, 0
    for i in range(functions.bounds[place], functions.bounds[place + 1]):
        code, operand = functions.codes[i], functions.operands[i]
        if code <= _CURVE:
            if code == _NUMBER:
                stack[depth] = operand
            elif code == _NAME:
                stack[depth] = functions.variables[int(operand)]
            else:
                stack[depth] = _evaluate_curve(functions, int(operand))
            depth += 1
        elif code >= _ABS:
            stack[depth - 1] = _apply_function(code, stack[depth - 1])
        else:
            depth -= 1
            stack[depth - 1] = _apply_operator(code, stack[depth - 1], stack[depth])
    return float(stack[0])
