"""Uniform sampling clock behind inexact time stamps.

A recorder samples at a fixed rate, but many files state the instants inexactly. Their stamps are rounded to a few
digits, or were taken by a program when a sample arrived. An error of the stamps acts as noise of the displacement,
in proportion to the velocity.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_EXACT_DEVIATION = 0.01
"""Deviation of stamps from a uniform clock over the time step [1], below which it does not matter."""
_ROUNDING_DEVIATION = 0.75
"""Largest deviation over the resolution of the stamps [1] that is attributed to rounding or truncation."""
_FINEST_DIGITS = 9
"""Largest number of decimals of a stamp in seconds."""
_CLEAR_GAIN = 0.9
"""Ratio of the displacement's noise on both time bases [1], below which the uniform one is taken."""
_WINDOW = 5
"""Samples of the displacement to which a cubic is fitted."""


class SamplingClock(NamedTuple):
    """Instants of the samples."""

    time: Array
    """(N,) [s]"""
    note: str
    """Reason for other instants than the recorded ones, for a person; empty if they were kept."""


def restore_sampling_clock(time: Array, displacement: Array) -> SamplingClock:
    """Return uniform instants if the stamps only deviate from them by rounding or by late stamping.

    Args:
        time: recorded stamps, shape (N,) [s].
        displacement: shape (N,) [m]; it decides where the stamps do not show rounding.
    """
    index = np.arange(len(time), dtype=np.float64)
    step, start = np.polyfit(index, time - time[0], 1)
    uniform = time[0] + start + step * index
    deviation = float(np.max(np.abs(time - uniform)))
    if not step > 0.0 or deviation < _EXACT_DEVIATION * step:
        return SamplingClock(time, "")
    resolution = find_resolution(time)
    if deviation <= _ROUNDING_DEVIATION * resolution:
        note = f"the time stamps are rounded to {resolution:g} s"
        return SamplingClock(uniform, f"{note}; the samples are taken as uniform, {step:.4g} s apart")
    # A larger deviation is a gap, or a change of the rate.
    if deviation > step or not _is_smoother(displacement, time, uniform):
        return SamplingClock(time, "")
    note = (
        f"the time stamps deviate from a uniform clock by up to {deviation:.2g} s, and the displacement does not"
    )
    return SamplingClock(uniform, f"{note}; the samples are taken as uniform, {step:.4g} s apart")


def find_resolution(time: Array) -> float:
    """Return the coarsest decimal unit [s] of which all stamps (N,) [s] are multiples; 0 without one."""
    for digits in range(_FINEST_DIGITS + 1):
        scaled = time * 10.0**digits
        # A decimal number is stored with a relative error of up to eps.
        tolerance = max(1e-4, 4.0 * float(np.finfo(float).eps * np.max(np.abs(scaled))))
        if np.max(np.abs(scaled - np.rint(scaled))) < tolerance < 0.1:
            return float(10.0**-digits)
    return 0.0


def _is_smoother(displacement: Array, time: Array, uniform: Array) -> bool:
    """Return True if the displacement has clearly less noise on the uniform instants than on the stamps."""
    if not (np.diff(time) > 0.0).all():
        return True
    return compute_noise(displacement, uniform) < _CLEAR_GAIN * compute_noise(displacement, time)


def compute_noise(values: Array, time: Array) -> float:
    """Return the standard deviation of white noise on smooth values (N,) at increasing instants (N,) [s].

    In each window of five samples, a cubic leaves one degree of freedom. Its direction is that of the fourth
    divided difference.
    """
    instants = np.lib.stride_tricks.sliding_window_view(time, _WINDOW)
    # One column at a time: all differences at once would need 25 numbers for each sample.
    weights = np.stack(
        [1.0 / np.prod(instants[:, [k]] - np.delete(instants, k, axis=1), axis=1) for k in range(_WINDOW)], axis=1
    )
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    remainders = np.sum(weights * np.lib.stride_tricks.sliding_window_view(values, _WINDOW), axis=1)
    return float(np.sqrt(np.mean(remainders**2)))
