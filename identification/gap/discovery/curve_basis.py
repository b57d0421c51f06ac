"""Basis of smooth curves over one variable, with independent coefficients of the same size.

A curve is a cubic spline with a penalty on its roughness. The coefficients are rotated and scaled so that the
penalty becomes their sum of squares. The penalty is that of Eilers and Marx (1996), the rotation that of Wood
(2017, 5.4). One prior deviation then sets smoothness and amplitude together. The amplitude hardly depends on the
number of knots. A curve that repeats is a Fourier series instead, with higher harmonics less probable.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.interpolate import BSpline

from identification.arrays import Array

Direction = Literal["none", "sign", "velocity"]
"""Factor of a curve: none, the sign of the velocity as in dry friction, or the velocity as in a viscous force."""
Warp = Literal["none", "symmetric", "logarithmic"]
"""Scale on which the knots are even.

``symmetric`` resolves small values of both signs, ``logarithmic`` small positive ones.
"""
KNOT_COUNT = 12
"""Number of cubic splines of a curve."""
FINE_KNOT_COUNT = 40
"""Number of cubic splines of a fine curve over time, in which a change may return up to 20 times."""
_GRID_POINTS = 401
"""Points at which the basis is tabulated."""
_LEVEL_PENALTY = 0.02
"""Penalty on the level of a curve, relative to that on its roughness."""
_RESOLUTION = 2e-3
"""Smallest value that a warped scale resolves, relative to the largest."""
MAX_GROWTH = 30.0
"""Largest growth with the drive, over the inverse of the highest drive [1]."""
_HARMONICS = 3
"""Number of harmonics of a curve that repeats."""
_QUANTILES = (0.001, 0.999)
"""Quantiles of the variable between which the knots lie."""


@dataclass(frozen=True)
class CurveBasis:
    """Tabulated basis: curves (K,) over positions of one variable."""

    positions: tuple[float, ...]
    """(G,) values of the variable, increasing."""
    table: tuple[tuple[float, ...], ...]
    """(K, G) values of each basis curve there; beyond the ends they are constant, or repeat."""
    period: float | None = None
    """Period of the curves, in the unit of the variable; None where they do not repeat."""

    @property
    def size(self) -> int:
        """Number of coefficients K."""
        return len(self.table)

    def evaluate(self, variable: Array, coefficients: Iterable[Any]) -> Any:
        """Return the curve (N,) with some coefficients (K,) at values (N,) of the variable."""
        values = sum(c * row for c, row in zip(coefficients, self._rows, strict=True))
        return np.interp(variable, self._grid, values, period=self.period)

    @cached_property
    def _grid(self) -> Array:
        return np.array(self.positions)

    @cached_property
    def _rows(self) -> Array:
        return np.array(self.table)


def make_basis(values: Array, warp: Warp, count: int = KNOT_COUNT) -> CurveBasis:
    """Return a basis of some number of splines over the range of some values of the variable (N,)."""
    low, high = (float(q) for q in np.quantile(values, _QUANTILES))
    size = max(abs(low), abs(high), 1e-300)
    even = np.linspace(_warp(low / size, warp), _warp(high / size, warp), _GRID_POINTS)
    positions = size * _unwarp(even, warp)
    inner = np.linspace(0.0, 1.0, count - 2)
    step = inner[1]
    knots = np.concatenate([-step * np.arange(3, 0, -1), inner, 1.0 + step * np.arange(1, 4)])
    splines = BSpline.design_matrix(np.linspace(0.0, 1.0, _GRID_POINTS), knots, 3).toarray()
    return CurveBasis(
        tuple(positions.tolist()), tuple(map(tuple, (splines @ _compute_rotation(count)).T.tolist()))
    )


def make_periodic_basis(period: float) -> CurveBasis:
    """Return a Fourier basis with a period; the size of harmonic k is 1 / k², so all have the same curvature."""
    angle = np.linspace(0.0, 2.0 * np.pi, _GRID_POINTS, endpoint=False)
    orders = range(1, _HARMONICS + 1)
    waves = [wave(k * angle) / k**2 for k in orders for wave in (np.sin, np.cos)]
    positions = period * angle / (2.0 * np.pi)
    return CurveBasis(tuple(positions.tolist()), tuple(tuple(w.tolist()) for w in waves), period)


def _compute_rotation(count: int) -> Array:
    """Return the matrix (K, K) from independent coefficients to those of some number of splines."""
    differences = np.diff(np.eye(count), 2, axis=0)
    penalty = differences.T @ differences + _LEVEL_PENALTY * np.eye(count)
    values, vectors = np.linalg.eigh(penalty)
    return np.asarray(vectors / np.sqrt(values))


def _warp(value: float, warp: Warp) -> float:
    match warp:
        case "symmetric":
            return float(np.arcsinh(value / _RESOLUTION))
        case "logarithmic":
            return float(np.log1p(value / _RESOLUTION))
        case _:
            return value


def _unwarp(values: Array, warp: Warp) -> Array:
    match warp:
        case "symmetric":
            return np.asarray(_RESOLUTION * np.sinh(values))
        case "logarithmic":
            return np.asarray(_RESOLUTION * np.expm1(values))
        case _:
            return values


@dataclass(frozen=True)
class CurveFunction:
    """Function of a curve effect: a curve over the first variable, times direction and growth with the drive."""

    basis: CurveBasis
    variables: tuple[str, ...]
    """The variable of the curve, then those of its factors."""
    scale: float
    """Value of a curve of size one, in the unit of the place over that of the factors."""
    direction: Direction = "none"
    drive_factor: bool = False
    """True where the curve is proportional to the drive."""
    grows_with_drive: bool = False
    """True where the last parameter is the relative growth with the drive."""
    is_response: bool = False
    """True where the result is a step response: one less the curve, and one beyond its end."""

    def __call__(self, variables: Mapping[str, Array], *values: Any) -> Any:
        """Return the value (N,) for variables (N,) each, coefficients and, where it grows, [1/drive]."""
        curve = self.evaluate(variables, values[: self.basis.size])
        return curve * (1.0 + values[-1] * variables["drive"]) if self.grows_with_drive else curve

    def evaluate(self, variables: Mapping[str, Array], coefficients: Iterable[Any]) -> Any:
        """Return the value (N,) with some coefficients (K,), without growth."""
        variable = variables[self.variables[0]]
        curve = self.scale * self.basis.evaluate(variable, coefficients)
        if self.is_response:
            return np.where(variable < self.basis.positions[-1], 1.0 - curve, 1.0)
        match self.direction:
            case "sign":
                curve = curve * np.sign(variables["velocity"])
            case "velocity":
                curve = curve * variables["velocity"]
        return curve * variables["drive"] if self.drive_factor else curve


@dataclass(frozen=True)
class LinearGrowth:
    """Linear model of a curve that grows with the drive: one curve, and one proportional to the drive."""

    function: CurveFunction
    highest_drive: float
    """Drive at which the second curve has its own size [drive]."""

    def __call__(self, variables: Mapping[str, Array], *values: Any) -> Any:
        """Return the value (N,) for the coefficients (2K,) of both curves."""
        first, second = values[: self.function.basis.size], values[self.function.basis.size :]
        drive = variables["drive"] / self.highest_drive
        return self.function.evaluate(variables, first) + drive * self.function.evaluate(variables, second)

    def separate(self, values: Array) -> tuple[Array, float]:
        """Return the coefficients (K,) and growth [1/drive] of the nearest curve that is a product."""
        left, sizes, right = np.linalg.svd(values.reshape(2, -1), full_matrices=False)
        level, growth = left[:, 0]
        if abs(level) < abs(growth) / MAX_GROWTH:
            level = growth / MAX_GROWTH
        return np.asarray(level * sizes[0] * right[0]), float(growth / level / self.highest_drive)
