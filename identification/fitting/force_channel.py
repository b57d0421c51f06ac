"""Low-pass filter of the force channel, applied to the simulated force.

The filter delays the force and rounds the corners of a loop at its reversals, which determine the yield
displacement. Of the displacement's filter only the delay matters, because strokes are slow.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.logs import ChannelFilter
from identification.simulate import compute_settled_state, design_low_pass, filter_series


@dataclass(frozen=True)
class LowPass:
    """Discrete filter, exact for a force that is linear between samples.

    At a reversal a force turns within a millisecond, so it is simulated at ``oversampling`` times the recorded
    rate.
    """

    channel_filter: ChannelFilter
    """The filter as the device reports it."""
    rate: float
    """Rate of the recording [Hz]."""
    oversampling: int = 1

    def apply(self, values: Array) -> Array:
        """Return the filtered values at the N samples of the recording, settled at the first value.

        Args:
            values: ((N - 1) oversampling + 1,) or (..., U).
        """
        numerator, denominator = self._coefficients
        # Settled at the first force: starting from zero, the filter would ring at the start of every stretch.
        settled = compute_settled_state(numerator, denominator)
        series = values.reshape(len(values), -1)
        recorded = np.empty((1 + (len(values) - 1) // self.oversampling, series.shape[1]))
        # Series by series: all together would need their memory once more at the oversampled rate.
        for column, one in zip(recorded.T, series.T, strict=True):
            filtered = filter_series(numerator, denominator, one, settled * one[0])
            column[:] = filtered[:: self.oversampling]
        return recorded.reshape(-1, *values.shape[1:])

    @cached_property
    def _coefficients(self) -> tuple[Array, Array]:
        """Numerator and denominator of the Butterworth filter at the oversampled rate."""
        reported = self.channel_filter
        return design_low_pass(reported.order, reported.cutoff, 1 / (self.rate * self.oversampling))


def compute_filter_delay(reported: ChannelFilter | None) -> float:
    """Return the delay [s] of slow signals in a Butterworth low-pass, 1 / (w_c sin(pi / 2N)); 0 without one."""
    if reported is None:
        return 0.0
    return 1.0 / (2 * np.pi * reported.cutoff * float(np.sin(np.pi / (2 * reported.order))))
