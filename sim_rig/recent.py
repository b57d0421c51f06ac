"""The newest samples of one channel, and no more."""

import numpy as np
import numpy.typing as npt

from sim_rig.compiled import Array

Instants = npt.NDArray[np.int64]


class Recent:
    """Keeps at least ``size`` samples and at most twice as many; used under its owner's lock."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._times: Instants = np.empty(2 * size, np.int64)
        self._values: Array = np.empty(2 * size)
        self._end = 0

    def add(self, times: Instants, values: Array) -> None:
        """Samples at (K,) instants [ns], all later than those before; K is at most ``size``."""
        if self._end + len(times) > len(self._times):
            kept = slice(self._end - self._size, self._end)
            self._times[: self._size], self._values[: self._size] = self._times[kept], self._values[kept]
            self._end = self._size
        new = slice(self._end, self._end + len(times))
        self._times[new], self._values[new] = times, values
        self._end = new.stop

    def latest(self, count: int, before_ns: int) -> tuple[Instants, Array]:
        """Copies of the newest ``count`` samples not later than ``before_ns``; fewer where fewer are kept."""
        stop = int(np.searchsorted(self._times[: self._end], before_ns, side="right"))
        part = slice(max(stop - count, 0), stop)
        return self._times[part].copy(), self._values[part].copy()
