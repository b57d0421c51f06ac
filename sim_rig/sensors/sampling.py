"""Low-pass filter and interpolation of true signals, chunk by chunk."""

import math

import numba
import numpy as np
import numpy.typing as npt
from scipy import signal

from sim_rig.plant import Array, compile_function, compile_inline
from sim_rig.scenario import Filter


class FilterStream:
    """An analogue low-pass, settled at its first value.

    It is discretised exactly for a signal that is linear between samples (first-order hold).
    """

    def __init__(self, filter_: Filter, dt: float) -> None:
        """Discretise the filter.

        Args:
            filter_: family, order and cutoff.
            dt: [s] sample period of its signal.
        """
        analogue = signal.butter(filter_.order, 2 * math.pi * filter_.cutoff, analog=True)
        numerator, denominator, _ = signal.cont2discrete(analogue, dt, method="foh")
        self._b, self._a = np.ravel(numerator).astype(float), np.ravel(denominator).astype(float)
        self._state: Array | None = None

    def feed(self, values: Array) -> Array:
        """Return the filter's output for further input ``values``."""
        if not len(values):
            return values
        if self._state is None:
            self._state = signal.lfilter_zi(self._b, self._a) * values[0]
        return apply_filter(self._b, self._a, values, self._state)


def interpolate_cubic(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """Return a signal at any instants [s], by cubic interpolation through four samples.

    Args:
        values: sampled every dt [s]; at least four.
        dt: [s]
        instants: since time 0 [s]; beyond its ends the signal is constant.
        first: index of the first of the values, where index 0 is at time 0.
    """
    return _compiled_cubic(np.ascontiguousarray(values), dt, np.ascontiguousarray(instants), first)


def _evaluate_cubic(values: Array, position: float, first: int) -> float:
    """Return the cubic at a position, in samples since time 0."""
    position = min(max(position, 0.0), first + len(values) - 1.0)
    i = min(max(math.floor(position), first + 1), first + len(values) - 3)
    t, k = position - i, i - first
    return float(
        values[k] * (1 + t) * (1 - t) * (2 - t) / 2
        + values[k + 1] * t * (1 + t) * (2 - t) / 2
        - values[k - 1] * t * (1 - t) * (2 - t) / 6
        - values[k + 2] * t * (1 + t) * (1 - t) / 6
    )


evaluate_cubic = compile_inline(_evaluate_cubic)


def _interpolate_cubic(values: Array, dt: float, instants: Array, first: int) -> Array:
    result = np.empty(len(instants))
    for j in range(len(instants)):
        result[j] = evaluate_cubic(values, instants[j] / dt, first)
    return result


VECTOR = numba.float64[::1]
"""Type of `Array` in the signature of a compiled function."""
_compiled_cubic = compile_function(_interpolate_cubic, VECTOR(VECTOR, numba.float64, VECTOR, numba.int64))


def apply_filter(b: Array, a: Array, values: Array, state: Array) -> Array:
    """Return the output of a digital filter for further input; update its state.

    Args:
        b: (n+1,) coefficients of the input, n at least 1.
        a: (n+1,) coefficients of the output, the first of them 1.
        values: (N,) input.
        state: (n,) of the transposed direct form II, as `scipy.signal.lfilter` has it.
    """
    filtered = np.empty(len(values))
    _compiled_filter(b, a, np.ascontiguousarray(values, np.float64), state, filtered)
    return filtered


def _filter(b: Array, a: Array, values: Array, state: Array, filtered: Array) -> None:
    order = len(state)
    for j in range(len(values)):
        filtered[j] = state[0] + b[0] * values[j]
        for k in range(1, order):
            state[k - 1] = state[k] + b[k] * values[j] - a[k] * filtered[j]
        state[order - 1] = b[order] * values[j] - a[order] * filtered[j]


_compiled_filter = compile_function(_filter, numba.void(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR), brief=True)


def sample_held(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """Return a signal held for dt [s] from each sample, read half way; arguments as `interpolate_cubic`."""
    indices: npt.NDArray[np.int64] = np.rint(instants / dt).astype(np.int64) - first
    return np.asarray(values[np.clip(indices, 0, len(values) - 1)])
