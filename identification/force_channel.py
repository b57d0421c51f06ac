"""The low-pass in the force channel, applied to the simulated force as the device applies it to the true one.

A filter is not only late: it rounds the corners that a loop has at its reversals, and those corners are what
fixes the yield displacement. The displacement's own filter needs no more than its delay, for strokes are slow.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import signal

from identification.arrays import Array
from identification.recordings import ChannelFilter


@dataclass(frozen=True)
class LowPass:
    """A discrete filter, exact for a force that goes straight from sample to sample.

    A force turns within a millisecond at a reversal, so it is simulated ``finer`` times as densely as recorded.
    """

    reported: ChannelFilter
    """What the device says of it."""
    rate: float
    """[Hz] of the recording."""
    finer: int = 1

    def apply(self, values: Array) -> Array:
        """Values ((N - 1) finer + 1,) or (..., U) behind the filter, settled at their first, at the N samples."""
        numerator, denominator = self._coefficients
        # As if the first force had stood for ever: a filter from zero would ring at the start of every stretch.
        settled = signal.lfilter_zi(numerator, denominator)
        start = settled if values.ndim == 1 else settled[:, None]
        found: Array = signal.lfilter(numerator, denominator, values, axis=0, zi=start * values[:1])[0]
        return found[:: self.finer]

    @cached_property
    def _coefficients(self) -> tuple[Array, Array]:
        """Numerator and denominator of the Butterworth filter at the finer rate."""
        analogue = signal.butter(self.reported.order, 2 * np.pi * self.reported.cutoff, analog=True)
        numerator, denominator, _ = signal.cont2discrete(analogue, 1 / (self.rate * self.finer), method="foh")
        # cont2discrete returns the numerator as a matrix of one row.
        return np.ravel(numerator), np.ravel(denominator)


def filter_lag(reported: ChannelFilter | None) -> float:
    """Delay [s] of slow signals in a Butterworth low-pass: 1 / (w_c sin(pi / 2N)); 0 without one."""
    if reported is None:
        return 0.0
    return 1.0 / (2 * np.pi * reported.cutoff * float(np.sin(np.pi / (2 * reported.order))))
