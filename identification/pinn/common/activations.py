"""Activation functions of the hidden layer, with their first two derivatives.

Each function yields values, first and second derivatives over the layer's input, one array at a time. The next
array may overwrite the previous one: the arrays are large, and allocating memory costs as much as using it.
"""

from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

import numpy as np

from identification.arrays import Array

Activation = Literal["tanh", "sine", "gaussian"]
"""Name of an activation function; `sine` is a research option."""


class ActivationFunction(NamedTuple):
    """An activation function and its range of slopes."""

    max_slope: float
    """Largest slope of a unit's input over an element [1]; it makes some forty functions distinguishable."""
    derivatives: Callable[[Array, Array], Iterator[Array]]
    """Function of inputs (..., units), which it may overwrite, and of their slopes (units,)."""


def _evaluate_tanh(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.tanh(inner, out=inner)
    yield value
    derivative = value * value
    np.subtract(1.0, derivative, out=derivative)
    derivative *= slope
    yield derivative
    value *= derivative
    value *= -2.0 * slope
    yield value


def _evaluate_sine(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.sin(inner)
    yield value
    derivative: Array = np.cos(inner, out=inner)
    derivative *= slope
    yield derivative
    value *= -(slope**2)
    yield value


def _evaluate_gaussian(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.exp(-0.5 * inner**2)
    yield value
    derivative = inner * value
    derivative *= -slope
    yield derivative
    value *= (inner**2 - 1.0) * slope**2
    yield value


ACTIVATIONS: dict[Activation, ActivationFunction] = {
    "tanh": ActivationFunction(10.0, _evaluate_tanh),
    "sine": ActivationFunction(60.0, _evaluate_sine),
    "gaussian": ActivationFunction(20.0, _evaluate_gaussian),
}
