"""What a unit of the hidden layer makes of its input, with the first two derivatives.

Each yields its values, their slopes over the place and the slopes of these, one at a time: an array that was
yielded may be written over by the next, for they are large and new memory costs as much as its use.
"""

from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

import numpy as np

from identification.arrays import Array

Activation = Literal["tanh", "sine", "gaussian"]
"""What the units are."""


class Units(NamedTuple):
    """A kind of unit."""

    steepest: float
    """[1] largest slope of a unit's input over an element: with it some forty functions stand apart."""
    derivatives: Callable[[Array, Array], Iterator[Array]]
    """Of inputs (..., units), which may be written over, and their slopes over the place (units,)."""


def _tanh(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.tanh(inner, out=inner)
    yield value
    rise = value * value
    np.subtract(1.0, rise, out=rise)
    rise *= slope
    yield rise
    value *= rise
    value *= -2.0 * slope
    yield value


def _sine(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.sin(inner)
    yield value
    rise: Array = np.cos(inner, out=inner)
    rise *= slope
    yield rise
    value *= -(slope**2)
    yield value


def _gaussian(inner: Array, slope: Array) -> Iterator[Array]:
    value: Array = np.exp(-0.5 * inner**2)
    yield value
    rise = inner * value
    rise *= -slope
    yield rise
    value *= (inner**2 - 1.0) * slope**2
    yield value


ACTIVATIONS: dict[Activation, Units] = {
    "tanh": Units(10.0, _tanh),
    "sine": Units(60.0, _sine),
    "gaussian": Units(20.0, _gaussian),
}
