"""Channel buffer: the latest samples of one channel on the bench clock, with interpolation between them."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bench.log import SMOOTHING_WINDOW, smooth_velocity

Instants = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.float64]

_MAX_SAMPLES = 20_000
"""Largest number of samples that are kept."""
_DISTANT_FUTURE_NS = 1 << 62
"""[ns] Instant of the bench clock after all samples."""


class ChannelBuffer:
    """Latest samples of one channel."""

    def __init__(self) -> None:
        self.time_ns: Instants = np.empty(0, np.int64)
        """Bench clock [ns], increasing, shape (samples,)."""
        self.values: Numbers = np.empty(0)
        """Shape (samples,)."""
        self.start_ns = _DISTANT_FUTURE_NS
        """Bench clock of the channel's first sample, kept or discarded [ns]."""

    @property
    def size(self) -> int:
        """Number of samples that are kept."""
        return len(self.time_ns)

    @property
    def first_ns(self) -> int:
        """Bench clock of the oldest sample kept [ns]."""
        return int(self.time_ns[0])

    @property
    def newest_ns(self) -> int:
        """Bench clock of the newest sample [ns]."""
        return int(self.time_ns[-1])

    @property
    def half_window_ns(self) -> int:
        """Time after an instant from which its slope needs samples [ns]."""
        step = float(np.median(np.diff(self.time_ns[-32:]))) if self.size > 1 else 0.0
        return round(max(SMOOTHING_WINDOW / 2 * 1e9 + step, 3 * step))

    def add(self, time_ns: Instants, values: Numbers) -> None:
        """Add samples; one that is not later than all before it is ignored."""
        before = np.concatenate([self.time_ns[-1:] if self.size else [-1], np.maximum.accumulate(time_ns)])
        is_later = time_ns > before[:-1]
        self.time_ns = np.concatenate([self.time_ns, time_ns[is_later]])[-_MAX_SAMPLES:]
        self.values = np.concatenate([self.values, values[is_later]])[-_MAX_SAMPLES:]
        if self.start_ns == _DISTANT_FUTURE_NS and self.size:
            self.start_ns = self.first_ns

    def spread_times(self, received_ns: int, count: int) -> Instants:
        """Return evenly spaced instants [ns] since the newest sample, for samples without a device clock."""
        last = self.newest_ns if self.size else received_ns
        return np.linspace(last, received_ns, count + 1)[1:].astype(np.int64)

    def discard_before(self, before_ns: int) -> None:
        """Discard older samples, except the last four of them."""
        # A cubic needs two samples on each side of an instant, and the oldest instant may precede the first
        # sample.
        start = max(int(np.searchsorted(self.time_ns, before_ns)) - 4, 0)
        self.time_ns, self.values = self.time_ns[start:], self.values[start:]

    def interpolate(self, instants: Instants, gap_ns: int, cubic: bool) -> Numbers:
        """Interpolate between the samples.

        Args:
            instants: bench clock [ns], shape (N,).
            gap_ns: largest distance of two samples [ns] between which values are interpolated.
            cubic: use a cubic through four samples instead of a straight line through two.

        Returns:
            Shape (N,), NaN where no value is known.
        """
        if self.size < 2:
            return np.full(len(instants), np.nan)
        right = np.clip(np.searchsorted(self.time_ns, instants), 1, self.size - 1)
        is_inside = (instants >= self.time_ns[0]) & (instants <= self.time_ns[-1])
        is_exact = (self.time_ns[right] == instants) | (self.time_ns[right - 1] == instants)
        is_known = is_inside & (is_exact | (self.time_ns[right] - self.time_ns[right - 1] <= gap_ns))
        return np.where(is_known, self._interpolate_everywhere(instants, right, cubic), np.nan)

    def _interpolate_everywhere(self, instants: Instants, right: npt.NDArray[np.int64], cubic: bool) -> Numbers:
        """Interpolate regardless of gaps; ``right`` are the indices of the samples after the instants."""
        # Relative to the first sample, so that the times as floats keep all digits.
        origin = self.time_ns[0]
        times, targets = (self.time_ns - origin).astype(np.float64), (instants - origin).astype(np.float64)
        if cubic and self.size >= 4:
            values = _interpolate_cubic(times, self.values, targets, right)
        else:
            values = np.interp(targets, times, self.values)
        return values

    def hold_last(self, instants: Instants, gap_ns: int) -> Numbers:
        """Return the last value before each instant (N,) [ns]; NaN if it is older than ``gap_ns``."""
        if not self.size:
            return np.full(len(instants), np.nan)
        last = np.searchsorted(self.time_ns, instants, side="right") - 1
        age = instants - self.time_ns[np.maximum(last, 0)]
        return np.where((last >= 0) & (age <= gap_ns), self.values[np.maximum(last, 0)], np.nan)

    def differentiate(self, gap_ns: int) -> "ChannelBuffer":
        """Return the rate of change [1/s] at the samples; each part without a gap is smoothed separately."""
        rates = ChannelBuffer()
        rates.time_ns, rates.values = self.time_ns, np.zeros(self.size)
        edges = [0, *(np.flatnonzero(np.diff(self.time_ns) > gap_ns) + 1).tolist(), self.size]
        for start, stop in pairwise(edges):
            if stop - start > 1:
                step = float(np.median(np.diff(self.time_ns[start:stop])))
                rates.values[start:stop] = smooth_velocity(self.values[start:stop], 1e9 / step)
        return rates


def _interpolate_cubic(times: Numbers, values: Numbers, targets: Numbers, right: npt.NDArray[np.int64]) -> Numbers:
    """Interpolate by Lagrange's form through two samples on each side, which may be unevenly spaced."""
    first = np.clip(right - 2, 0, len(times) - 4)
    neighbours = [first + k for k in range(4)]
    result = np.zeros(len(targets))
    for k, node in enumerate(neighbours):
        others = [other for j, other in enumerate(neighbours) if j != k]
        weight = np.ones(len(targets))
        for other in others:
            weight *= (targets - times[other]) / (times[node] - times[other])
        result += weight * values[node]
    return result
