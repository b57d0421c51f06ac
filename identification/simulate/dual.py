"""Exact derivatives of functional forms by dual numbers (forward mode; Griewank and Walther 2008, ch. 3).

A dual number is a value with its derivatives over some arguments. A form consists of numpy's elementary functions,
and numpy passes each of them to the rules below. So one call of a form gives its value and all of its derivatives.
Derivatives that are zero are not stored. Where a function has a corner, the derivative is zero or one-sided.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from identification.arrays import Array
from identification.simulate.curves import RELATIVE_STEP, differentiate_by_argument

Partials = dict[int, Any]
"""Derivatives by the number of the argument; (N,) or a number each."""


class DualNumber(NDArrayOperatorsMixin):
    """Value (N,) or a number, with its derivatives over arguments."""

    def __init__(self, value: Any, partials: Partials) -> None:
        self.value, self.partials = value, partials

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.value)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Apply an elementary function; comparisons and roundings return plain values."""
        if method != "__call__" or options:
            return NotImplemented
        values = [_get_value(i) for i in inputs]
        if ufunc in _PLAIN:
            return ufunc(*values)
        if ufunc not in _RULES:
            return NotImplemented
        found = ufunc(*values)
        partials: Partials = {}
        for operand, rule in zip(inputs, _RULES[ufunc], strict=True):
            if isinstance(operand, DualNumber):
                with np.errstate(all="ignore"):  # derivatives at corners
                    factor = rule(found, *values)
                for k, part in operand.partials.items():
                    partials[k] = partials[k] + factor * part if k in partials else factor * part
        return DualNumber(found, partials)

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        """Apply ``np.where``, or ``np.interp`` over a table of dual numbers."""
        if function is np.where:
            return _choose(*arguments)
        if function is np.interp:
            at, positions, table = arguments
            rows = {k: np.interp(at, positions, row, **options) for k, row in table.partials.items()}
            return DualNumber(np.interp(at, positions, table.value, **options), rows)
        return NotImplemented


def differentiate(function: Callable[..., Any], arguments: Sequence[Any]) -> tuple[Any, list[Any]]:
    """Return the result of a function, and its derivative over each argument.

    Args:
        function: a form without memory; it may return several results, which are stacked.
        arguments: arrays (N,) or numbers.

    Raises:
        TypeError: the function uses an operation without a rule.
    """
    found = function(*(DualNumber(value, {k: 1.0}) for k, value in enumerate(arguments)))
    results = found if isinstance(found, tuple) else (found,)
    values = [_get_value(r) for r in results]
    shape = np.broadcast_shapes(*(np.shape(a) for a in (*arguments, *values)))

    def stack(parts: Sequence[Any]) -> Any:
        rows = [np.broadcast_to(part, shape) for part in parts]
        return np.stack(rows) if isinstance(found, tuple) else rows[0]

    partials = [_get_partials(r) for r in results]
    return stack(values), [stack([p.get(k, 0.0) for p in partials]) for k in range(len(arguments))]


def evaluate_by_differences(function: Callable[[float], Array], argument: Any) -> Any:
    """Return the result (N,) of a function of one number that is none of numpy's elementary functions."""
    if not isinstance(argument, DualNumber):
        return function(argument)
    value = argument.value
    slope = differentiate_by_argument(function, value, RELATIVE_STEP * abs(value))
    return DualNumber(function(value), {k: slope * part for k, part in argument.partials.items()})


def _get_value(operand: Any) -> Any:
    return operand.value if isinstance(operand, DualNumber) else operand


def _get_partials(operand: Any) -> Partials:
    return operand.partials if isinstance(operand, DualNumber) else {}


def _choose(condition: Any, first: Any, second: Any) -> DualNumber:
    """Return the first value where a condition holds, else the second."""
    over = [_get_partials(o) for o in (first, second)]
    rows = {k: np.where(condition, *(o.get(k, 0.0) for o in over)) for k in dict.fromkeys([*over[0], *over[1]])}
    return DualNumber(np.where(condition, _get_value(first), _get_value(second)), rows)


def _differentiate_base(found: Any, base: Any, exponent: Any) -> Any:
    """Return the derivative of a power over its base; zero where it is infinite at a base of zero."""
    slope = exponent * np.power(base, exponent - 1.0)
    return np.where(np.isfinite(slope), slope, 0.0)


def _differentiate_exponent(found: Any, base: Any, exponent: Any) -> Any:
    """Return the derivative of a power over its exponent; zero at a base of zero."""
    return np.where(np.asarray(base) > 0.0, found * np.log(np.where(np.asarray(base) > 0.0, base, 1.0)), 0.0)


_RULES: dict[np.ufunc, tuple[Callable[..., Any], ...]] = {
    np.add: (lambda y, a, b: 1.0, lambda y, a, b: 1.0),
    np.subtract: (lambda y, a, b: 1.0, lambda y, a, b: -1.0),
    np.multiply: (lambda y, a, b: b, lambda y, a, b: a),
    np.divide: (lambda y, a, b: 1.0 / b, lambda y, a, b: -y / b),
    np.power: (_differentiate_base, _differentiate_exponent),
    np.maximum: (lambda y, a, b: np.greater_equal(a, b), lambda y, a, b: np.less(a, b)),
    np.minimum: (lambda y, a, b: np.less_equal(a, b), lambda y, a, b: np.greater(a, b)),
    np.negative: (lambda y, a: -1.0,),
    np.absolute: (lambda y, a: np.sign(a),),
    np.exp: (lambda y, a: y,),
    np.log: (lambda y, a: 1.0 / a,),
    np.sqrt: (lambda y, a: 0.5 / y,),
    np.sin: (lambda y, a: np.cos(a),),
    np.cos: (lambda y, a: -np.sin(a),),
    np.tanh: (lambda y, a: 1.0 - y * y,),
}
"""Derivative of each function over each of its inputs, from its result and its inputs."""
_PLAIN = {np.sign, np.rint, np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal}
"""Functions whose derivative is zero, or whose result is a truth value."""
