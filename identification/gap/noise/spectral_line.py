"""Mains frequency: the strongest line between 45 and 65 Hz in the residual of a fit."""

import numpy as np

from identification.arrays import Array

MAINS_FREQUENCY = 50.0
"""Usual mains frequency [Hz]."""
_LOWEST, _HIGHEST = 45.0, 65.0
"""Range of the mains frequency [Hz]."""
_PADDING_FACTOR = 8
"""Factor by which zero padding refines the spectrum."""


def find_mains_frequency(error: Array, rate: float) -> float:
    """Find the frequency [Hz] between 45 and 65 Hz at which a force error is strongest.

    Args:
        error: force error [N] of one stretch, (N,); zero where it was not measured.
        rate: sampling rate [Hz].
    """
    if rate < 2.0 * _HIGHEST:
        return MAINS_FREQUENCY
    count = _PADDING_FACTOR * len(error)
    spectrum = np.abs(np.fft.rfft(error, count))
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    near = (frequency > _LOWEST) & (frequency < _HIGHEST)
    return float(frequency[near][np.argmax(spectrum[near])])
