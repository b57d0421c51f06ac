"""The strongest line near the mains' frequency in what a fit leaves."""

import numpy as np

from identification.problem import Problem

_LOWEST, _HIGHEST = 45.0, 65.0
"""[Hz]"""
_PADDED = 8
"""[1] how many times finer than its own resolution a spectrum is looked at."""


def strongest_line(problem: Problem, unknowns: np.ndarray) -> float:
    """Frequency [Hz] between 45 and 65 Hz at which the error of the force is strongest, in the longest piece."""
    pieces = problem.pieces
    longest = max(range(len(pieces)), key=lambda i: len(pieces[i].force))
    piece = pieces[longest]
    if piece.stroke.rate < 2.0 * _HIGHEST:
        return 0.5 * (_LOWEST + _HIGHEST)
    error = (piece.recorded(problem.setting(unknowns, longest))[0] - piece.force) * piece.train
    count = _PADDED * len(error)
    spectrum = np.abs(np.fft.rfft(error, count))
    frequency = np.fft.rfftfreq(count, 1.0 / piece.stroke.rate)
    near = (frequency > _LOWEST) & (frequency < _HIGHEST)
    return float(frequency[near][np.argmax(spectrum[near])])
