"""The low-pass in the force channel, applied to the simulated force as the device applies it to the true one.

A filter is not only late: it rounds the corners that a loop has at its reversals, and those corners are what
fixes the yield displacement. The displacement's own filter needs no more than its delay, for strokes are slow.
"""

from typing import NamedTuple

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.recordings import ChannelFilter


class LowPass(NamedTuple):
    """A discrete filter, exact for a force that goes straight from sample to sample."""

    numerator: Array
    denominator: Array
    lag: float
    """[s] delay of slow signals."""

    def apply(self, values: Array) -> Array:
        """Values (N,) or (N, U) behind the filter, settled at their first."""
        settled = signal.lfilter_zi(self.numerator, self.denominator)
        start = settled if values.ndim == 1 else settled[:, None]
        found: Array = signal.lfilter(self.numerator, self.denominator, values, axis=0, zi=start * values[:1])[0]
        return found


def low_pass(reported: ChannelFilter, rate: float) -> LowPass:
    """The Butterworth filter that a device reports, at a sampling rate [Hz]."""
    turn = 2 * np.pi * reported.cutoff
    analogue = signal.butter(reported.order, turn, analog=True)
    numerator, denominator, _ = signal.cont2discrete(analogue, 1 / rate, method="foh")
    return LowPass(np.ravel(numerator), np.ravel(denominator), filter_lag(reported))


def filter_lag(reported: ChannelFilter | None) -> float:
    """Delay [s] of slow signals in a Butterworth low-pass: 1 / (w_c sin(pi / 2N)); 0 without one."""
    if reported is None:
        return 0.0
    return 1.0 / (2 * np.pi * reported.cutoff * float(np.sin(np.pi / (2 * reported.order))))
