"""The samples of one channel on the bench clock."""

import numpy as np
import pytest

from bench.rig.track import Track

MS = 1_000_000


def track(times, values):
    made = Track()
    made.add(instants(*times), np.array(values, dtype=np.float64))
    return made


def instants(*times):
    return np.round(np.array(times) * MS).astype(np.int64)


def test_samples_that_come_twice_or_out_of_turn_are_left_out():
    one = track([0, 1, 3, 2, 4], [0, 1, 3, 99, 4])
    one.add(np.array([4, 5]) * MS, np.array([99.0, 5.0]))
    assert one.time_ns.tolist() == [0, 1 * MS, 3 * MS, 4 * MS, 5 * MS]
    assert one.values.tolist() == [0, 1, 3, 4, 5]


def test_a_cubic_goes_through_what_is_one_also_where_samples_are_uneven():
    times = np.array([0, 1, 2.5, 3, 4.5, 6])
    one = track(times, times**3 - 2 * times)
    asked = np.array([0.5, 2.0, 2.5, 3.7, 5.9])
    assert one.at(instants(*asked), 10 * MS, smooth=True) == pytest.approx(asked**3 - 2 * asked)


def test_between_samples_too_far_apart_nothing_is_known_but_at_them_it_is():
    one = track([0, 1, 20, 21], [0, 1, 20, 21])
    found = one.at(instants(0.5, 1, 5, 20, 20.5, 22, -1), 10 * MS, smooth=False)
    assert found[[0, 1, 3, 4]] == pytest.approx([0.5, 1, 20, 20.5])
    assert np.isnan(found[[2, 5, 6]]).all()


def test_one_sample_alone_says_nothing_between():
    assert np.isnan(track([1], [5]).at(instants(1), 10 * MS, smooth=True)).all()


def test_what_is_held_is_the_last_value_as_long_as_it_is_fresh():
    one = track([10, 20], [1, 2])
    found = one.held(instants(9, 10, 19.9, 20, 24, 26), 5 * MS)
    assert np.isnan(found[[0, 2, 5]]).all()
    assert found[[1, 3, 4]].tolist() == [1, 2, 2]
    assert np.isnan(Track().held(instants(1), MS)).all()


def test_what_is_forgotten_leaves_enough_for_the_instants_that_follow():
    times = np.arange(100.0)
    whole, short = track(times, np.sin(times / 9)), track(times, np.sin(times / 9))
    short.forget(60 * MS)
    assert short.size < 50
    later = instants(*np.arange(60, 99, 0.37))
    assert short.at(later, 10 * MS, smooth=True).tolist() == whole.at(later, 10 * MS, smooth=True).tolist()
    assert short.began == 0


def test_samples_without_a_clock_are_spread_since_the_last_ones():
    one = track([10], [0])
    assert one.spread(30 * MS, 4).tolist() == [15 * MS, 20 * MS, 25 * MS, 30 * MS]
    assert Track().spread(30 * MS, 2).tolist() == [30 * MS, 30 * MS]


def test_a_slope_is_taken_within_stretches_and_not_across_a_gap():
    times = np.concatenate([np.arange(50), 200 + np.arange(50)])
    one = track(times, np.concatenate([2e-3 * times[:50], 5.0 - 3e-3 * times[50:]]))
    slopes = one.slope(10 * MS).values
    assert slopes[:50] == pytest.approx(2.0)
    assert slopes[50:] == pytest.approx(-3.0)
