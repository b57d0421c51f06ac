"""Decimated batches keep extremes, begin and span."""

import math

import numpy as np
import pytest

from bench.live import Channel, LiveBatch, decimate


def make_batch(*rows):
    channels = tuple(Channel(f"channel{k}", "N") for k in range(len(rows)))
    return LiveBatch(9, 100.0, 1e-3, channels, np.array(rows, np.float32))


@pytest.mark.parametrize(("count", "factor"), [(40, 4), (41, 4), (100, 10), (1000, 7), (7, 3)])
def test_extremes_begin_and_span_are_kept(count, factor):
    values = np.random.default_rng(5).normal(size=(3, count))
    batch = make_batch(*values)
    found = decimate(batch, factor)
    np.testing.assert_array_equal(found.values.min(axis=1), batch.values.min(axis=1))
    np.testing.assert_array_equal(found.values.max(axis=1), batch.values.max(axis=1))
    assert (found.sequence, found.utc_s) == (9, 100.0)
    assert found.count * found.period_s == pytest.approx(count * 1e-3)
    assert found.count <= count / factor + 2


def test_lowest_and_highest_value_keep_their_order():
    found = decimate(make_batch([0, 5, -5, 1], [3, -2, 8, 0]), 2)
    np.testing.assert_array_equal(found.values, [[5, -5], [-2, 8]])


def test_one_spike_among_a_thousand_samples_is_kept():
    values = np.sin(np.arange(1000) / 100)
    values[517] = 40.0
    assert decimate(make_batch(values), 50).values.max() == 40.0


def test_a_missing_value_is_left_out_and_an_interval_without_values_stays_missing():
    found = decimate(make_batch([math.nan, 2, 1, math.nan, *[math.nan] * 4]), 2)
    np.testing.assert_array_equal(found.values, [[2, 1, math.nan, math.nan]])


@pytest.mark.parametrize("factor", [0, 1, 2])
def test_a_batch_that_cannot_become_smaller_stays_as_it_is(factor):
    batch = make_batch([1.0, 2.0])
    assert decimate(batch, factor) is batch
