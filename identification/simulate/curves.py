"""Interpolation between samples, first-order lag, and derivatives of forms by differences."""

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.damper import Quantity
from identification.simulate.digital_filter import filter_series

RELATIVE_STEP = 1e-6
"""Step of a difference relative to the parameter [1]; errors of rounding and curvature both stay below 1e-9."""
_MIN_LAG = 1e-6
"""Lag below which a first-order expansion replaces the filter [s]."""


def interpolate_hermite(value: Array, slope: Array, i: Any, t: Any, h: float) -> tuple[Array, Array]:
    """Return value and derivative at the fraction t of sample i, from values and derivatives at the samples."""
    d = value[..., i + 1] - value[..., i]
    square = 3.0 * d - h * (2.0 * slope[..., i] + slope[..., i + 1])
    cube = h * (slope[..., i] + slope[..., i + 1]) - 2.0 * d
    return (
        value[..., i] + t * (h * slope[..., i] + t * (square + t * cube)),
        slope[..., i] + t * (2.0 * square + 3.0 * t * cube) / h,
    )


def interpolate_midpoints(value: Array, slope: Array, h: float) -> tuple[Array, Array]:
    """Return value and derivative half way between samples, (..., N-1) each."""
    d = value[..., 1:] - value[..., :-1]
    middle = 0.5 * (value[..., 1:] + value[..., :-1]) + h / 8.0 * (slope[..., :-1] - slope[..., 1:])
    return middle, 1.5 * d / h - 0.25 * (slope[..., :-1] + slope[..., 1:])


def differentiate_by_parameters(
    function: Callable[..., Any], values: tuple[float, ...], quantities: tuple[Quantity, ...]
) -> list[Any]:
    """Differentiate a function over each of its parameters, by differences of second order."""
    return [_differentiate_by_parameter(function, values, k, q) for k, q in enumerate(quantities)]


def _differentiate_by_parameter(
    function: Callable[..., Any], values: tuple[float, ...], k: int, quantity: Quantity
) -> Any:
    # The size of a parameter that is zero is that of its scale.
    step = RELATIVE_STEP * max(abs(values[k]), 0.1 * quantity.scale)

    def at(times: float) -> Any:
        moved = list(values)
        moved[k] += times * step
        return np.asarray(function(*moved))

    # A form may be undefined beyond its bound, so the difference is one-sided there, of the same order.
    if values[k] - step < quantity.low:
        return (4.0 * at(1.0) - 3.0 * at(0.0) - at(2.0)) / (2.0 * step)
    return (at(1.0) - at(-1.0)) / (2.0 * step)


def differentiate_by_argument(function: Callable[[Any], Any], values: Any, step: float) -> Any:
    """Differentiate a form over one of its arguments at every sample, by central differences."""
    return (np.asarray(function(values + step)) - np.asarray(function(values - step))) / (2.0 * step)


def apply_lag(values: Array, lag: float, h: float) -> Array:
    """Apply a first-order lag [s] to values (N, ...); exact for values that are linear between samples."""
    if lag < _MIN_LAG:
        # First order in the lag, because h / lag is undefined at zero.
        return values - lag * np.gradient(values, h, axis=0)
    fade = float(np.exp(-h / lag))
    new = 1.0 - lag / h * (1.0 - fade)
    old = 1.0 - fade - new
    b, a = np.array([new, old]), np.array([1.0, -fade])
    series = values.reshape(len(values), -1).T
    lagged = [filter_series(b, a, one, one[:1] * (fade + old)) for one in series]
    return np.stack(lagged, axis=1).reshape(values.shape)
