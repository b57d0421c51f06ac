"""Low-pass filter and interpolation of true signals, chunk by chunk."""

import math

import numba
import numpy as np
import numpy.typing as npt

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
        self._b, self._a = design_low_pass(filter_.order, filter_.cutoff, dt)
        self._state: Array | None = None

    def feed(self, values: Array) -> Array:
        """Return the filter's output for further input ``values``."""
        if not len(values):
            return values
        if self._state is None:
            # The gain at rest is 1.
            self._state = np.cumsum((self._b - self._a)[:0:-1])[::-1] * values[0]
        return apply_filter(self._b, self._a, values, self._state)


class ResponseStream:
    """Step response of a defined effect, settled at its first value."""

    def __init__(self, weights: Array) -> None:
        """Start with the weights (L,) of the last values [1], the newest first."""
        self._weights = weights
        self._last: Array | None = None

    def feed(self, values: Array) -> Array:
        """Return the response to further input ``values``."""
        if not len(values):
            return values
        if self._last is None:
            self._last = np.full(len(self._weights) - 1, values[0])
        known = np.concatenate([self._last, values])
        self._last = known[len(values) :]
        return np.convolve(known, self._weights, "valid")


def design_low_pass(order: int, cutoff: float, dt: float) -> tuple[Array, Array]:
    """Return numerator and denominator (n+1,) of a Butterworth filter, exact for inputs linear between samples.

    Each pole is a first-order lag whose response to a ramp is known in closed form. With `scipy.signal`, every
    start of the simulated rig would take a second longer.

    Args:
        order: number n of poles.
        cutoff: frequency at which the gain is the square root of a half [Hz].
        dt: [s] sample period.
    """
    poles = 2 * math.pi * cutoff * np.exp(1j * math.pi * (2 * np.arange(order) + order + 1) / (2 * order))
    decays = np.exp(poles * dt)
    new = (decays - 1.0 - poles * dt) / (poles**2 * dt)
    old = (decays - 1.0) / poles - new
    numerator = np.zeros(order + 1, np.complex128)
    for k in range(order):
        others = np.delete(np.arange(order), k)
        residue = np.prod(-poles) / np.prod(poles[k] - poles[others])
        numerator += residue * np.convolve([new[k], old[k]], np.poly(decays[others]))
    return np.array(numerator.real), np.array(np.poly(decays).real, np.float64)


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
