"""Decimation that keeps the extremes."""

import numpy as np

from bench.samples import select_extremes


def noise(seed, count=10_000):
    return np.random.default_rng(seed).normal(size=count).astype(np.float32)


def test_the_extremes_of_every_interval_and_channel_stay():
    columns = [noise(1), noise(2)]
    rows = select_extremes(columns, 10_000, 50)
    for column in columns:
        kept = column[rows]
        for first in range(0, 10_000, 200):
            inside = (rows >= first) & (rows < first + 200)
            assert kept[inside].min() == column[first : first + 200].min()
            assert kept[inside].max() == column[first : first + 200].max()


def test_a_single_peak_and_both_ends_stay():
    column = np.zeros(12_345, np.float32)
    column[7_777] = 1.0
    rows = select_extremes([column], len(column), 10)
    assert 7_777 in rows
    assert (rows[0], rows[-1]) == (0, 12_344)
    assert len(rows) <= 22


def test_few_samples_stay_all():
    assert list(select_extremes([noise(1, 20)], 20, 10)) == list(range(20))


def test_missing_values_are_no_extremes():
    column = noise(3, 1000)
    column[100:300] = np.nan
    rows = select_extremes([column], 1000, 10)
    assert not np.isnan(column[rows]).any()
    assert len(select_extremes([np.full(1000, np.nan, np.float32)], 1000, 10)) == 2
