"""Division of bench samples into live batches of equal distances."""

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bench.live.batch import MAX_SEQUENCE, Channel, LiveBatch

_MAX_STEP = 1.5
"""Distance of two samples, as a multiple of the median, above which samples are missing between them."""


class BatchMaker:
    """Maker of consecutively numbered batches.

    Args:
        units: unit of each channel.
    """

    def __init__(self, units: Mapping[str, str]) -> None:
        self._units = units
        self._sequence = 0

    def make(
        self, time_ns: npt.NDArray[np.int64], columns: Mapping[str, npt.NDArray[np.float64]], utc_origin_s: float
    ) -> Iterator[LiveBatch]:
        """Yield the batches of some samples; where samples are missing, another batch begins.

        Args:
            time_ns: bench clock [ns], increasing, shape (samples,).
            columns: values by channel, each of shape (samples,).
            utc_origin_s: UTC at zero of the bench clock [s since 1970].
        """
        channels = tuple(Channel(name, self._units.get(name, "1")) for name in columns)
        values = np.stack(list(columns.values())).astype(np.float32)
        seconds = time_ns.astype(np.float64) * 1e-9
        for start, stop in find_parts(seconds):
            period = float(seconds[stop - 1] - seconds[start]) / max(stop - start - 1, 1)
            sequence, self._sequence = self._sequence, (self._sequence + 1) & MAX_SEQUENCE
            yield LiveBatch(sequence, utc_origin_s + seconds[start], period, channels, values[:, start:stop])


def find_parts(seconds: npt.NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return first index and end of each part without a missing sample; times [s], shape (samples,)."""
    steps = np.diff(seconds)
    breaks = np.flatnonzero(steps > _MAX_STEP * np.median(steps)) + 1 if len(steps) else np.empty(0, np.int64)
    return list(pairwise([0, *breaks.tolist(), len(seconds)]))
