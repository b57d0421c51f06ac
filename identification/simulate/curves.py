"""Small tools on sampled curves: values between samples, and derivatives of forms by differences."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.damper import Quantity

_RELATIVE_STEP = 1e-6
"""[1] step of a difference over the size of what is moved: rounding and curvature both stay below 1e-9."""
_MIN_LAG = 1e-6
"""[s] a lag below which values pass as they are."""


def interpolate_hermite(value: Array, slope: Array, i: Any, t: Any, h: float) -> tuple[Array, Array]:
    """Value and its derivative at the fraction t of sample i, from values and slopes at the samples."""
    d = value[..., i + 1] - value[..., i]
    square = 3.0 * d - h * (2.0 * slope[..., i] + slope[..., i + 1])
    cube = h * (slope[..., i] + slope[..., i + 1]) - 2.0 * d
    return (
        value[..., i] + t * (h * slope[..., i] + t * (square + t * cube)),
        slope[..., i] + t * (2.0 * square + 3.0 * t * cube) / h,
    )


def interpolate_midpoints(value: Array, slope: Array, h: float) -> tuple[Array, Array]:
    """Value and its derivative half way between samples, (..., N-1) each."""
    d = value[..., 1:] - value[..., :-1]
    middle = 0.5 * (value[..., 1:] + value[..., :-1]) + h / 8.0 * (slope[..., :-1] - slope[..., 1:])
    return middle, 1.5 * d / h - 0.25 * (slope[..., :-1] + slope[..., 1:])


def differentiate_by_parameters(
    function: Callable[..., Any], values: tuple[float, ...], quantities: tuple[Quantity, ...]
) -> list[Any]:
    """Derivative of a function of the parameters over each of them, by differences of the second order."""
    return [_differentiate_by_parameter(function, values, k, q) for k, q in enumerate(quantities)]


def _differentiate_by_parameter(
    function: Callable[..., Any], values: tuple[float, ...], k: int, quantity: Quantity
) -> Any:
    # A parameter that is zero has no size of its own.
    step = _RELATIVE_STEP * max(abs(values[k]), 0.1 * quantity.scale)

    def at(times: float) -> Any:
        moved = list(values)
        moved[k] += times * step
        return np.asarray(function(*moved))

    # Beyond its bound a form need not mean anything: one-sided there, of the same order.
    if values[k] - step < quantity.low:
        return (4.0 * at(1.0) - 3.0 * at(0.0) - at(2.0)) / (2.0 * step)
    return (at(1.0) - at(-1.0)) / (2.0 * step)


def differentiate_by_argument(function: Callable[[Array], Any], values: Array, step: float) -> Any:
    """Derivative of a form over one of its arguments, at every sample, by central differences."""
    return (np.asarray(function(values + step)) - np.asarray(function(values - step))) / (2.0 * step)


def apply_lag(values: Array, lag: float, h: float) -> Array:
    """Values (N, ...) behind a first-order lag [s], exact for what goes straight from sample to sample."""
    if lag < _MIN_LAG:
        # To first order in the lag, down to zero, where h / lag means nothing.
        return values - lag * np.gradient(values, h, axis=0)
    fade = float(np.exp(-h / lag))
    new = 1.0 - lag / h * (1.0 - fade)
    old = 1.0 - fade - new
    start = values[:1] * (fade + old)
    return np.asarray(signal.lfilter([new, old], [1.0, -fade], values, axis=0, zi=start)[0])
