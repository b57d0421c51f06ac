"""Decimation that keeps every extreme: the samples with the lowest and highest values of each interval stay."""

from collections.abc import Iterable

import numpy as np

from bench.samples.table import Column, Rows


def select_extremes(columns: Iterable[Column], count: int, intervals: int) -> Rows:
    """Return the samples that a plot needs, in order.

    They are real samples of all channels at once, so that a curve of one channel over another stays exact there.

    Args:
        columns: channels whose extremes are kept, each of shape (count,).
        count: number of samples.
        intervals: number of intervals of equally many samples.

    Returns:
        Numbers of the samples, among them the first and the last: at most two for each interval and channel.
    """
    if count <= 2 * intervals:
        return np.arange(count)
    width = -(-count // intervals)
    kept = [np.array([0, count - 1])]
    for column in columns:
        kept += _find_extremes(column, width)
    return np.unique(np.concatenate(kept))


def _find_extremes(column: Column, width: int) -> list[Rows]:
    """Return the numbers of the lowest and of the highest value of each interval; an interval of NaN has none."""
    missing = -len(column) % width
    blocks = np.pad(column, (0, missing), constant_values=np.nan).reshape(-1, width)
    is_given = ~np.isnan(blocks).all(axis=1)
    first = np.flatnonzero(is_given) * width
    given = blocks[is_given]
    return [first + np.nanargmin(given, axis=1), first + np.nanargmax(given, axis=1)] if len(given) else []
