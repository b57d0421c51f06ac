"""Digital filters along series; with `scipy.signal`, every command would take a second longer to start."""

import numpy as np

from identification.arrays import Array, njit_cached


def filter_series(numerator: Array, denominator: Array, values: Array, state: Array | None = None) -> Array:
    """Return the output (N,) of a digital filter.

    Args:
        numerator: (n+1,) coefficients of the input, n at least 1.
        denominator: (n+1,) coefficients of the output, the first of them 1.
        values: (N,) input.
        state: (n,) at the start, of the transposed direct form II as in `scipy.signal.lfilter`; None for zero.
    """
    b, a = np.asarray(numerator, np.float64), np.asarray(denominator, np.float64)
    start = np.zeros(len(b) - 1) if state is None else np.array(state, np.float64)
    filtered = np.empty(len(values))
    _filter(b, a, np.ascontiguousarray(values, np.float64), start, filtered)
    return filtered


def compute_settled_state(numerator: Array, denominator: Array) -> Array:
    """Return the state (n,) of a filter that has settled at an input of 1; arguments as in `filter_series`."""
    gain = np.sum(numerator) / np.sum(denominator)
    return np.asarray(np.cumsum((numerator - gain * denominator)[:0:-1])[::-1])


def design_low_pass(order: int, cutoff: float, h: float) -> tuple[Array, Array]:
    """Return numerator and denominator (n+1,) of a Butterworth filter, exact for inputs linear between samples.

    Each pole is a first-order lag whose response to a ramp is known in closed form.

    Args:
        order: number n of poles.
        cutoff: frequency at which the gain is the square root of a half [Hz].
        h: time between two samples [s].
    """
    angles = np.pi * (2 * np.arange(order) + order + 1) / (2 * order)
    poles = 2 * np.pi * cutoff * np.exp(1j * angles)
    decays = np.exp(poles * h)
    new = (decays - 1.0 - poles * h) / (poles**2 * h)
    old = (decays - 1.0) / poles - new
    numerator = np.zeros(order + 1, np.complex128)
    for k in range(order):
        others = np.delete(np.arange(order), k)
        residue = np.prod(-poles) / np.prod(poles[k] - poles[others])
        numerator += residue * np.convolve([new[k], old[k]], np.poly(decays[others]))
    return np.array(numerator.real), np.array(np.poly(decays).real, np.float64)


@njit_cached
def _filter(b: Array, a: Array, values: Array, state: Array, filtered: Array) -> None:
    order = len(state)
    for j in range(len(values)):
        filtered[j] = state[0] + b[0] * values[j]
        for k in range(1, order):
            state[k - 1] = state[k] + b[k] * values[j] - a[k] * filtered[j]
        state[order - 1] = b[order] * values[j] - a[order] * filtered[j]
