"""The strongest line near the mains' frequency in what a fit leaves."""

import numpy as np

from identification.arrays import Array

MAINS = 50.0
"""[Hz]"""
_LOWEST, _HIGHEST = 45.0, 65.0
"""[Hz]"""
_PADDED = 8
"""[1] how many times finer than its own resolution a spectrum is looked at."""


def strongest_line(error: Array, rate: float) -> float:
    """Frequency [Hz] between 45 and 65 Hz at which an error of the force is strongest.

    Args:
        error: (N,) of one stretch [N], zero where nothing was measured.
        rate: samples a second [Hz].
    """
    if rate < 2.0 * _HIGHEST:
        return MAINS
    count = _PADDED * len(error)
    spectrum = np.abs(np.fft.rfft(error, count))
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    near = (frequency > _LOWEST) & (frequency < _HIGHEST)
    return float(frequency[near][np.argmax(spectrum[near])])
