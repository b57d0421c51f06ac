"""Expressions of effect files: parsed into instructions for a stack machine, never executed as code.

The instructions are plain data, so one expression is evaluated on whole arrays here, and sample by sample in
compiled code of the simulated rig.
"""

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from identification.errors import EffectFileError

FUNCTIONS = {"abs": np.abs, "sign": np.sign, "exp": np.exp, "log": np.log, "tanh": np.tanh, "sin": np.sin}
"""Admitted functions of one argument."""
_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
_MAX_LENGTH = 1000
"""Largest number of characters of an expression."""
_MAX_EXPONENT = 50.0
"""Largest argument of exp: a search that leaves its range meets a large number and no overflow."""
_SMALLEST = 1e-12
"""Smallest size of a divisor and of a base with a negative exponent.

It is also the smallest argument of log and the smallest base with a fractional exponent.
"""


class Instruction(NamedTuple):
    """One step of the stack machine."""

    code: str
    """``number`` or ``name`` pushes a value; an operator or function replaces its arguments by its result."""
    operand: float | str = 0.0
    """The number, or the name of the variable or parameter."""


@dataclass(frozen=True)
class Expression:
    """Parsed expression."""

    text: str
    instructions: tuple[Instruction, ...]

    @staticmethod
    def parse(text: str) -> "Expression":
        """Parse an expression.

        Raises:
            EffectFileError: the text is too long or contains anything but finite numbers, names, ``+ - * / **``
                and the functions of ``FUNCTIONS``.
        """
        if len(text) > _MAX_LENGTH:
            raise EffectFileError(f"the expression has {len(text)} characters; at most {_MAX_LENGTH} are admitted")
        try:
            instructions = _translate(ast.parse(text.strip(), mode="eval").body)
        except EffectFileError:
            raise
        except (SyntaxError, RecursionError, MemoryError, ValueError, OverflowError) as error:
            raise EffectFileError(f"expression {text[:80]!r} cannot be read: {str(error)[:80]}") from error
        return Expression(text, tuple(instructions))

    @property
    def names(self) -> frozenset[str]:
        """Names of the variables and parameters."""
        return frozenset(str(i.operand) for i in self.instructions if i.code == "name")

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """Return the result for values of all names, numbers or arrays (N,).

        Raises:
            KeyError: a name has no value.
        """
        stack: list[Any] = []
        with np.errstate(all="ignore"):  # of a search that leaves the range of the variables
            for code, operand in self.instructions:
                if code == "number":
                    stack.append(operand)
                elif code == "name":
                    stack.append(values[str(operand)])
                elif code in FUNCTIONS:
                    stack.append(_apply_function(code, stack.pop()))
                else:
                    right = stack.pop()
                    stack.append(_apply_operator(code, stack.pop(), right))
        return stack[0]


def _translate(node: ast.expr) -> list[Instruction]:
    """Return the instructions of a node.

    Raises:
        EffectFileError: the node is of a kind that is not admitted.
    """
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            return [Instruction("number", _make_finite(number))]
        case ast.Name(id=name):
            return [Instruction("name", name)]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return [Instruction("number", 0.0), *_translate(operand), Instruction("-")]
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _translate(operand)
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            return [*_translate(left), *_translate(right), Instruction(_OPERATORS[type(operator)])]
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            return [*_translate(argument), Instruction(name)]
    raise EffectFileError(
        f"the expression contains {ast.unparse(node)[:40]!r}; admitted are numbers, names, + - * / ** and "
        f"{', '.join(FUNCTIONS)} of one argument"
    )


def _make_finite(number: float) -> float:
    """Return a number as a float.

    Raises:
        OverflowError: a float cannot hold it.
    """
    value = float(number)
    if math.isinf(value):
        raise OverflowError("number too large for a float")
    return value


def _apply_function(name: str, value: Any) -> Any:
    if name == "exp":
        return np.exp(np.minimum(value, _MAX_EXPONENT))
    if name == "log":
        return np.log(np.maximum(value, _SMALLEST))
    return FUNCTIONS[name](value)


def _apply_operator(operator: str, left: Any, right: Any) -> Any:
    match operator:
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case "/":
            return left / _keep_from_zero(right)
        case _:
            whole_base = np.where(right < 0.0, _keep_from_zero(left), left)
            base = np.where(right == np.rint(right), whole_base, np.maximum(left, _SMALLEST))
            return base ** (1.0 * right)


def _keep_from_zero(value: Any) -> Any:
    """Return a value that can be a divisor."""
    return np.where(np.abs(value) < _SMALLEST, _SMALLEST, value)
