"""Formulas that may replace a curve: short expressions of one variable, and their starts.

A curve is known only up to functions that the law can absorb, such as a straight line over displacement. A formula
is therefore fitted to a curve together with these functions, by linear least squares on a grid of its scales.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.damper.definitions import Expression
from identification.damper.effects import Place, Variable
from identification.gap.discovery.curve_basis import FINE_KNOT_COUNT
from identification.gap.discovery.curve_effects import CurveEffect, CurvePlace

Role = Literal["scale", "wave", "size", "power", "position"]
"""A scale is fitted, that of a wave from even frequencies. A size, of one value, makes a power dimensionless."""

_SCALES = np.geomspace(0.003, 3.0, 13)
"""Scales of the variable that are tried, over its largest size [1]."""
_HALF_WAVES = 0.5 * np.arange(1, 2 * FINE_KNOT_COUNT)
"""Numbers of half waves in the range of the variable that are tried; a curve shows no more."""
_POWERS = (0.4, 0.7, 1.5, 2.0, 3.0)
_POSITIONS = np.linspace(-0.8, 0.8, 9)
"""Positions that are tried, over the range of the variable about its middle [1]."""
_CANCELLATION = 30.0
"""Largest term of a formula, relative to the curve: larger terms cancel each other [1]."""
_EXTRAPOLATION = 1e3
"""Largest amplitude of a formula, relative to the curve [1]: a larger one describes what was not recorded."""
_STEP_WIDTH = 0.05
"""Width of the smooth sign that the law can absorb, over the largest speed [1]."""


@dataclass(frozen=True)
class Formula:
    """A short expression of the variable ``z``."""

    text: str
    """The expression; ``z`` stands for the variable."""
    amplitudes: Mapping[str, int]
    """Power of the variable's unit by which the unit of each amplitude is divided, by the amplitude's name."""
    others: Mapping[str, Role] = field(default_factory=dict)
    """Role of each parameter in which the expression is not linear, by its name."""

    def write(self, variable: Variable) -> str:
        """Return the expression of a variable."""
        return self.text.replace("z", variable)


_FIRST_HARMONIC = "a*sin(z/s)+b*sin(1.5707963+z/s)"

FORMULAS: tuple[Formula, ...] = (
    Formula("a*z", {"a": 1}),
    Formula("a*z**2", {"a": 2}),
    Formula("a*z*abs(z)", {"a": 2}),
    Formula("a*z**3", {"a": 3}),
    Formula("a*abs(z)", {"a": 1}),
    Formula("a*z**2+b*z**3", {"a": 2, "b": 3}),
    Formula("a*z**2+b*z**3+c*z**4", {"a": 2, "b": 3, "c": 4}),
    Formula("a*tanh(z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*abs(tanh(z/s))", {"a": 0}, {"s": "scale"}),
    Formula("a*tanh(z/s)+b*z", {"a": 0, "b": 1}, {"s": "scale"}),
    Formula("(a+b*exp(-abs(z)/r))*tanh(z/s)", {"a": 0, "b": 0}, {"r": "scale", "s": "scale"}),
    Formula("a*sign(z)*abs(z/s)**p", {"a": 0}, {"s": "size", "p": "power"}),
    Formula("a*abs(z/s)**p", {"a": 0}, {"s": "size", "p": "power"}),
    Formula("a*exp(-abs(z)/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*sign(z)*exp(-abs(z)/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*exp(-abs(z)/s)+b*exp(-abs(z)/r)", {"a": 0, "b": 0}, {"s": "scale", "r": "scale"}),
    Formula("a*exp(z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*exp(-z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*exp(z/s)+b*exp(-z/r)", {"a": 0, "b": 0}, {"s": "scale", "r": "scale"}),
    Formula("a*log(1+abs(z)/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*z/(s+abs(z))", {"a": 0}, {"s": "scale"}),
    Formula("a*(abs(z-m)+z-m)", {"a": 1}, {"m": "position"}),
    Formula("a*(abs(m-z)+m-z)", {"a": 1}, {"m": "position"}),
    Formula("a*(abs(z-m)+z-m)+b*(abs(l-z)+l-z)", {"a": 1, "b": 1}, {"m": "position", "l": "position"}),
    Formula("a*tanh((z-m)/s)", {"a": 0}, {"m": "position", "s": "scale"}),
    Formula("a*exp(-((z-m)/s)**2)", {"a": 0}, {"m": "position", "s": "scale"}),
    Formula(_FIRST_HARMONIC, {"a": 0, "b": 0}, {"s": "wave"}),
)
"""Expressions that are tried, the shortest first."""

PERIODIC_FORMULAS: tuple[Formula, ...] = (
    Formula(_FIRST_HARMONIC, {"a": 0, "b": 0}, {"s": "wave"}),
    *(
        Formula(
            f"{_FIRST_HARMONIC}+c*sin({k}*z/s)+d*sin(1.5707963+{k}*z/s)",
            {"a": 0, "b": 0, "c": 0, "d": 0},
            {"s": "wave"},
        )
        for k in (2, 3)
    ),
    Formula(
        f"{_FIRST_HARMONIC}+c*sin(2*z/s)+d*sin(1.5707963+2*z/s)+f*sin(3*z/s)+g*sin(1.5707963+3*z/s)",
        {"a": 0, "b": 0, "c": 0, "d": 0, "f": 0, "g": 0},
        {"s": "wave"},
    ),
)
"""Expressions for a curve that repeats: the fundamental, with the second harmonic, the third one, or both.

A curve over time may repeat as well, with a period that is found.
"""

RESPONSE_FORMULAS: tuple[Formula, ...] = (
    Formula("a*exp(-z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*(1+z/s)*exp(-z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*(1+z/s+0.5*(z/s)**2+0.16666667*(z/s)**3)*exp(-z/s)", {"a": 0}, {"s": "scale"}),
    Formula("a*exp(-z/s)*sin(1.5707963+z/r)", {"a": 0}, {"s": "scale", "r": "scale"}),
    Formula("a*exp(-z/s)+b*exp(-z/r)", {"a": 0, "b": 0}, {"s": "scale", "r": "scale"}),
)
"""Expressions for the part of a change that has not arrived: one, two or four equal lags, ringing, two lags."""


@dataclass(frozen=True)
class FormulaStart:
    """A formula with the values at which it is nearest to a curve."""

    formula: Formula
    values: dict[str, float]
    """Values of its parameters."""
    error: float
    """Part of the curve's variance that it does not reach [1]."""


def rank_formulas(curve: CurveEffect, coefficients: Array, variable: Array) -> list[FormulaStart]:
    """Return all formulas with their starts, the nearest to the curve first.

    Args:
        curve: the curve.
        coefficients: its coefficients (K,).
        variable: values (N,) of the variable in the recording; frequent ones count more.
    """
    target = curve.function.scale * curve.function.basis.evaluate(variable, coefficients)
    others = _list_absorbed(curve, variable)
    remaining = target - _project(others, target)
    starts = [_fit_formula(f, variable, remaining, others, curve.at.period) for f in _list_formulas(curve.at)]
    return sorted((s for s in starts if s.values), key=lambda s: s.error)


def _list_formulas(at: CurvePlace) -> tuple[Formula, ...]:
    """Return the expressions that are tried for a curve."""
    if at.is_response:
        return RESPONSE_FORMULAS
    if at.period:
        return PERIODIC_FORMULAS
    return FORMULAS + PERIODIC_FORMULAS[1:] if at.is_over_time else FORMULAS


def _list_absorbed(curve: CurveEffect, z: Array) -> Array:
    """Return the functions (N, M) of the variable that the law can absorb at the place of a curve."""
    size = max(float(np.abs(z).max()), 1e-300)
    columns = [np.ones(len(z))]
    straight: dict[Place, tuple[Variable, ...]] = {
        "field": ("drive",),
        "parallel_force": ("displacement", "velocity"),
        "displacement_channel": ("displacement", "velocity"),
        "force_channel": ("force", "drive"),
    }
    if curve.at.argument in straight.get(curve.at.place, ()) and curve.at.direction == "none":
        columns.append(z / size)
        if curve.at.argument == "velocity":
            columns.append(np.tanh(z / (_STEP_WIDTH * size)))
    return np.stack(columns, axis=1)


def _project(columns: Array, target: Array) -> Array:
    return np.asarray(columns @ np.linalg.lstsq(columns, target, rcond=None)[0])


def _fit_formula(formula: Formula, z: Array, target: Array, others: Array, period: float | None) -> FormulaStart:
    """Return the best start of a formula, over a grid of its scales, powers and positions, or at its period."""
    total = max(float(target @ target), 1e-300)
    best = FormulaStart(formula, {}, np.inf)
    for values in _iterate_grid(formula, z, period):
        columns = np.stack([_evaluate(formula, name, values, z) for name in formula.amplitudes], axis=1)
        if not np.isfinite(columns).all():
            continue
        cleaned = columns - np.stack([_project(others, c) for c in columns.T], axis=1)
        amplitudes = np.asarray(np.linalg.lstsq(cleaned, target, rcond=1e-9)[0], float)
        error = float(np.sum((target - cleaned @ amplitudes) ** 2)) / total
        if _has_large_terms(formula, columns, amplitudes, z, target):
            continue
        if error < best.error:
            found = {**values, **dict(zip(formula.amplitudes, map(float, amplitudes), strict=True))}
            best = FormulaStart(formula, found, error)
    return best


def _has_large_terms(formula: Formula, columns: Array, amplitudes: Array, z: Array, target: Array) -> bool:
    """Return True if terms cancel each other, or have their size far outside the recording."""
    largest, size = float(np.abs(target).max()), max(float(np.abs(z).max()), 1e-300)
    relative = np.abs(amplitudes) * size ** np.array(list(formula.amplitudes.values()), float)
    terms = np.abs(columns * amplitudes).max()
    return bool(terms > _CANCELLATION * largest or relative.max() > _EXTRAPOLATION * largest)


def _iterate_grid(formula: Formula, z: Array, period: float | None) -> Iterator[dict[str, float]]:
    size, low, high = max(float(np.abs(z).max()), 1e-300), float(z.min()), float(z.max())
    grids: dict[Role, list[float]] = {
        "scale": [float(size * s) for s in _SCALES],
        "wave": [period / (2.0 * np.pi)] if period else [float((high - low) / (np.pi * k)) for k in _HALF_WAVES],
        "size": [size],
        "power": list(_POWERS),
        "position": [float(0.5 * (low + high) + 0.5 * (high - low) * m) for m in _POSITIONS],
    }
    for chosen in product(*(grids[role] for role in formula.others.values())):
        yield dict(zip(formula.others, chosen, strict=True))


def _evaluate(formula: Formula, amplitude: str, values: Mapping[str, float], z: Array) -> Array:
    """Return the factor (N,) of one amplitude."""
    evaluate: Callable[..., Array] = Expression.parse(formula.text).evaluate
    return evaluate({**values, **dict.fromkeys(formula.amplitudes, 0.0), amplitude: 1.0, "z": z})
