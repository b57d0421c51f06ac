"""Decimation that keeps every extreme: each interval becomes its lowest and its highest value, in their order."""

import warnings
from dataclasses import replace

import numpy as np

from bench.live.batch import LiveBatch, Values


def decimate(batch: LiveBatch, factor: int) -> LiveBatch:
    """Return a batch with about ``1 / factor`` of the samples, with the same begin, span and number.

    A value is displaced in time by less than two of the new periods. Batches of fewer than three samples stay
    as they are.
    """
    intervals = -(-batch.count // (2 * max(factor, 1)))
    if factor < 2 or 2 * intervals >= batch.count:
        return batch
    edges = np.linspace(0, batch.count, intervals + 1).round().astype(np.int64)
    values = np.stack([_find_extremes(batch.values, edges[k], edges[k + 1]) for k in range(intervals)], axis=1)
    period = batch.period_s * batch.count / (2 * intervals)
    return replace(batch, values=values.reshape(len(batch.channels), 2 * intervals), period_s=period)


def _find_extremes(values: Values, start: int, stop: int) -> Values:
    """Return the lowest and highest value of each channel between two samples, shape (channels, 2)."""
    part = values[:, start:stop]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # an interval without any value stays NaN
        low, high = np.nanmin(part, axis=1), np.nanmax(part, axis=1)
    is_falling = np.argmax(part == high[:, None], axis=1) < np.argmax(part == low[:, None], axis=1)
    pair: Values = np.where(is_falling[:, None], np.stack([high, low], axis=1), np.stack([low, high], axis=1))
    return pair
