"""Step response of a channel: how a change of its signal arrives over the time since it.

A signal that is linear between samples is a sequence of ramps. Each of them arrives as the mean of the step
response over the times since its start and its end. The response of a linear channel to a whole signal is then a
weighted sum of its last samples (convolution; Oppenheim & Willsky 1997, 2.2).
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

HORIZON = 10.0
"""Time since a change after which a step response stays constant [s]."""
_POINTS = 4
"""Values of the step response whose mean stands for that over one sample."""
_SETTLED = 1e-12
"""Usual part of the whole change below which weights are omitted [1]; larger parts would disturb derivatives."""


def compute_weights(
    function: Callable[..., Any], values: Sequence[float], h: float, settled: float = _SETTLED
) -> Array:
    """Return the weights (L,) of the last samples in the response of a channel, the newest sample first.

    Args:
        function: step response [1] over ``time`` by name: the time since the change [s], then its parameters.
        values: values of the parameters.
        h: time between two samples [s].
        settled: part of the whole change below which later weights are omitted [1].
    """
    count = max(math.ceil(HORIZON / h), 2)
    time = h * (np.arange(count * _POINTS) + 0.5) / _POINTS
    response = np.asarray(function({"time": time}, *values)).reshape(count, _POINTS).mean(axis=1)
    remaining = np.abs(response - response[-1])
    unsettled = np.flatnonzero(remaining > settled * max(float(remaining.max()), np.finfo(float).tiny))
    length = int(unsettled[-1]) + 2 if len(unsettled) else 1
    return np.diff(response[:length], prepend=0.0)


def apply_weights(weights: Array, values: Array) -> Array:
    """Return the response (N, ...) to values (N, ...) whose first one lasted before them."""
    size = 1 << (len(values) + len(weights) - 1).bit_length()
    first = values[:1]
    # The channel is linear and has settled at the first value, so only the changes from it are convolved.
    spectrum = np.fft.rfft(values - first, size, axis=0)
    factors = np.fft.rfft(weights, size).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray(np.fft.irfft(spectrum * factors, size, axis=0)[: len(values)] + weights.sum() * first)
