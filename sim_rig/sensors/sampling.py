"""Low-pass filter and interpolation of true signals, chunk by chunk."""

import math

import numba
import numpy as np
import numpy.typing as npt
from scipy import signal

from sim_rig.plant import Array, compile_function
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
        self._b, self._a = np.ravel(numerator), np.ravel(denominator)
        self._state: Array | None = None

    def feed(self, values: Array) -> Array:
        """Return the filter's output for further input ``values``."""
        if not len(values):
            return values
        if self._state is None:
            self._state = signal.lfilter_zi(self._b, self._a) * values[0]
        filtered, self._state = signal.lfilter(self._b, self._a, values, zi=self._state)
        return np.asarray(filtered)


def interpolate_cubic(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """Return a signal at any instants [s], by cubic interpolation through four samples.

    Args:
        values: sampled every dt [s]; at least four.
        dt: [s]
        instants: since time 0 [s]; beyond its ends the signal is constant.
        first: index of the first of the values, where index 0 is at time 0.
    """
    return _compiled_cubic(np.ascontiguousarray(values), dt, np.ascontiguousarray(instants), first)


def _interpolate_cubic(values: Array, dt: float, instants: Array, first: int) -> Array:
    result = np.empty(len(instants))
    for j in range(len(instants)):
        position = min(max(instants[j] / dt, 0.0), first + len(values) - 1.0)
        i = min(max(math.floor(position), first + 1), first + len(values) - 3)
        t, k = position - i, i - first
        result[j] = (
            values[k] * (1 + t) * (1 - t) * (2 - t) / 2
            + values[k + 1] * t * (1 + t) * (2 - t) / 2
            - values[k - 1] * t * (1 - t) * (2 - t) / 6
            - values[k + 2] * t * (1 + t) * (1 - t) / 6
        )
    return result


_VECTOR = numba.float64[::1]
_compiled_cubic = compile_function(_interpolate_cubic, _VECTOR(_VECTOR, numba.float64, _VECTOR, numba.int64))


def sample_held(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """Return a signal held for dt [s] from each sample, read half way; arguments as `interpolate_cubic`."""
    indices: npt.NDArray[np.int64] = np.rint(instants / dt).astype(np.int64) - first
    return np.asarray(values[np.clip(indices, 0, len(values) - 1)])
