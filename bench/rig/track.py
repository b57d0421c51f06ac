"""The samples of one channel on the bench clock, and its value between them."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bench.recorder.velocity import WINDOW, smooth_velocity

Instants = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.float64]

_MOST = 20_000
"""Samples that are kept at most."""
_NEVER = 1 << 62
"""[ns] of the bench clock, later than any sample."""


class Track:
    """Samples of a channel, the newest of them kept."""

    def __init__(self) -> None:
        self.time_ns: Instants = np.empty(0, np.int64)
        """Bench clock [ns], increasing, shape (samples,)."""
        self.values: Numbers = np.empty(0)
        """Shape (samples,)."""
        self.began = _NEVER
        """Bench clock of the first sample of all [ns]."""

    @property
    def size(self) -> int:
        """How many samples are kept."""
        return len(self.time_ns)

    @property
    def first(self) -> int:
        """Bench clock of the oldest sample kept [ns]."""
        return int(self.time_ns[0])

    @property
    def newest(self) -> int:
        """Bench clock of the newest sample [ns]."""
        return int(self.time_ns[-1])

    @property
    def half_window(self) -> int:
        """[ns] of later samples that a slope needs."""
        step = float(np.median(np.diff(self.time_ns[-32:]))) if self.size > 1 else 0.0
        return round(max(WINDOW / 2 * 1e9 + step, 3 * step))

    def add(self, time_ns: Instants, values: Numbers) -> None:
        """Take samples; one that is not later than those before tells nothing new and is left out."""
        before = np.concatenate([self.time_ns[-1:] if self.size else [-1], np.maximum.accumulate(time_ns)])
        later = time_ns > before[:-1]
        self.time_ns = np.concatenate([self.time_ns, time_ns[later]])[-_MOST:]
        self.values = np.concatenate([self.values, values[later]])[-_MOST:]
        if self.began == _NEVER and self.size:
            self.began = self.first

    def spread(self, received_ns: int, count: int) -> Instants:
        """Instants of samples that have no clock and came together: evenly since the last that came [ns]."""
        last = self.newest if self.size else received_ns
        return np.linspace(last, received_ns, count + 1)[1:].astype(np.int64)

    def forget(self, before_ns: int) -> None:
        """Let go of what is older, but for the last such sample and the three before it."""
        # A cubic takes two samples on each side of an instant, and the oldest instant may lie before the first.
        start = max(int(np.searchsorted(self.time_ns, before_ns)) - 4, 0)
        self.time_ns, self.values = self.time_ns[start:], self.values[start:]

    def at(self, instants: Instants, gap_ns: int, smooth: bool) -> Numbers:
        """Values between the samples.

        Args:
            instants: bench clock [ns], shape (N,).
            gap_ns: [ns] between two samples beyond which nothing is known between them.
            smooth: along a cubic through four samples, in place of a straight line through two.

        Returns:
            Shape (N,), NaN where nothing is known.
        """
        if self.size < 2:
            return np.full(len(instants), np.nan)
        right = np.clip(np.searchsorted(self.time_ns, instants), 1, self.size - 1)
        inside = (instants >= self.time_ns[0]) & (instants <= self.time_ns[-1])
        exact = (self.time_ns[right] == instants) | (self.time_ns[right - 1] == instants)
        known = inside & (exact | (self.time_ns[right] - self.time_ns[right - 1] <= gap_ns))
        origin = self.time_ns[0]
        times, asked = (self.time_ns - origin).astype(np.float64), (instants - origin).astype(np.float64)
        if smooth and self.size >= 4:
            values = _cubic(times, self.values, asked, right)
        else:
            values = np.interp(asked, times, self.values)
        return np.where(known, values, np.nan)

    def held(self, instants: Instants, gap_ns: int) -> Numbers:
        """The last value before each instant (N,) [ns]; NaN where it is older than ``gap_ns``."""
        if not self.size:
            return np.full(len(instants), np.nan)
        last = np.searchsorted(self.time_ns, instants, side="right") - 1
        age = instants - self.time_ns[np.maximum(last, 0)]
        return np.where((last >= 0) & (age <= gap_ns), self.values[np.maximum(last, 0)], np.nan)

    def slope(self, gap_ns: int) -> "Track":
        """Rate of change [1/s] at the samples; each stretch without a gap is smoothed for itself."""
        found = Track()
        found.time_ns, found.values = self.time_ns, np.zeros(self.size)
        edges = [0, *(np.flatnonzero(np.diff(self.time_ns) > gap_ns) + 1).tolist(), self.size]
        for start, stop in pairwise(edges):
            if stop - start > 1:
                step = float(np.median(np.diff(self.time_ns[start:stop])))
                found.values[start:stop] = smooth_velocity(self.values[start:stop], 1e9 / step)
        return found


def _cubic(times: Numbers, values: Numbers, asked: Numbers, right: npt.NDArray[np.int64]) -> Numbers:
    """Through the two samples on each side, by Lagrange's form; the samples need not be evenly spaced."""
    first = np.clip(right - 2, 0, len(times) - 4)
    near = [first + k for k in range(4)]
    result = np.zeros(len(asked))
    for k, own in enumerate(near):
        others = [other for j, other in enumerate(near) if j != k]
        weight = np.ones(len(asked))
        for other in others:
            weight *= (asked - times[other]) / (times[own] - times[other])
        result += weight * values[own]
    return result
