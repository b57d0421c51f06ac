"""Buffer of the newest samples of one channel."""

import numpy as np

from sim_rig.live.interface import TimeArray
from sim_rig.plant import Array


class RingBuffer:
    """Keeps between ``size`` and twice ``size`` samples; to be used under its owner's lock."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._times: TimeArray = np.empty(2 * size, np.int64)
        self._values: Array = np.empty(2 * size)
        self._end = 0

    def add(self, times: TimeArray, values: Array) -> None:
        """Add samples at (K,) instants [ns], all later than those before; K is at most ``size``."""
        if self._end + len(times) > len(self._times):
            newest = slice(self._end - self._size, self._end)
            self._times[: self._size], self._values[: self._size] = self._times[newest], self._values[newest]
            self._end = self._size
        new = slice(self._end, self._end + len(times))
        self._times[new], self._values[new] = times, values
        self._end = new.stop

    def read_latest(self, count: int, before_ns: int) -> tuple[TimeArray, Array]:
        """Return copies of the newest ``count`` samples not later than ``before_ns``, or of all that are kept."""
        stop = int(np.searchsorted(self._times[: self._end], before_ns, side="right"))
        part = slice(max(stop - count, 0), stop)
        return self._times[part].copy(), self._values[part].copy()
