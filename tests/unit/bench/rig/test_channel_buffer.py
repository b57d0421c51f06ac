"""Samples of one channel on the bench clock."""

import numpy as np
import pytest

from bench.rig.channel_buffer import ChannelBuffer

MS = 1_000_000


def make_buffer(times, values):
    buffer = ChannelBuffer()
    buffer.add(instants(*times), np.array(values, dtype=np.float64))
    return buffer


def instants(*times):
    return np.round(np.array(times) * MS).astype(np.int64)


def test_repeated_and_late_samples_are_ignored():
    buffer = make_buffer([0, 1, 3, 2, 4], [0, 1, 3, 99, 4])
    buffer.add(np.array([4, 5]) * MS, np.array([99.0, 5.0]))
    assert buffer.time_ns.tolist() == [0, 1 * MS, 3 * MS, 4 * MS, 5 * MS]
    assert buffer.values.tolist() == [0, 1, 3, 4, 5]


def test_cubic_is_exact_for_a_cubic_with_uneven_samples():
    times = np.array([0, 1, 2.5, 3, 4.5, 6])
    buffer = make_buffer(times, times**3 - 2 * times)
    targets = np.array([0.5, 2.0, 2.5, 3.7, 5.9])
    assert buffer.interpolate(instants(*targets), 10 * MS, cubic=True) == pytest.approx(targets**3 - 2 * targets)


def test_values_in_a_gap_are_missing_but_not_at_its_samples():
    buffer = make_buffer([0, 1, 20, 21], [0, 1, 20, 21])
    values = buffer.interpolate(instants(0.5, 1, 5, 20, 20.5, 22, -1), 10 * MS, cubic=False)
    assert values[[0, 1, 3, 4]] == pytest.approx([0.5, 1, 20, 20.5])
    assert np.isnan(values[[2, 5, 6]]).all()


def test_single_sample_cannot_be_interpolated():
    assert np.isnan(make_buffer([1], [5]).interpolate(instants(1), 10 * MS, cubic=True)).all()


def test_last_value_is_held_up_to_a_limit():
    buffer = make_buffer([10, 20], [1, 2])
    values = buffer.hold_last(instants(9, 10, 19.9, 20, 24, 26), 5 * MS)
    assert np.isnan(values[[0, 2, 5]]).all()
    assert values[[1, 3, 4]].tolist() == [1, 2, 2]
    assert np.isnan(ChannelBuffer().hold_last(instants(1), MS)).all()


def test_discarding_keeps_the_samples_that_later_instants_need():
    times = np.arange(100.0)
    full, short = make_buffer(times, np.sin(times / 9)), make_buffer(times, np.sin(times / 9))
    short.discard_before(60 * MS)
    assert short.size < 50
    later = instants(*np.arange(60, 99, 0.37))
    assert (
        short.interpolate(later, 10 * MS, cubic=True).tolist()
        == full.interpolate(later, 10 * MS, cubic=True).tolist()
    )
    assert short.start_ns == 0


def test_samples_without_a_clock_are_spread_since_the_last_one():
    buffer = make_buffer([10], [0])
    assert buffer.spread_times(30 * MS, 4).tolist() == [15 * MS, 20 * MS, 25 * MS, 30 * MS]
    assert ChannelBuffer().spread_times(30 * MS, 2).tolist() == [30 * MS, 30 * MS]


def test_slope_is_not_taken_across_a_gap():
    times = np.concatenate([np.arange(50), 200 + np.arange(50)])
    buffer = make_buffer(times, np.concatenate([2e-3 * times[:50], 5.0 - 3e-3 * times[50:]]))
    slopes = buffer.differentiate(10 * MS).values
    assert slopes[:50] == pytest.approx(2.0)
    assert slopes[50:] == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("times", "half_window_ms"),
    [
        ([], 10.0),  # half of the smoothing window of 20 ms
        ([5], 10.0),
        ([5, 7], 12.0),  # and one step
        ([0, 1, 3], 11.5),  # the median step of 1 ms and 2 ms
        ([0, 4], 14.0),
        ([0, 6], 18.0),  # at least three steps
        ([*range(0, 100, 10), *range(100, 133)], 11.0),  # of the latest 32 samples
    ],
)
def test_slope_needs_half_a_smoothing_window_and_a_step(times, half_window_ms):
    assert make_buffer(times, [0] * len(times)).half_window_ns == round(half_window_ms * MS)


def test_two_samples_can_be_interpolated_three_without_a_cubic():
    assert make_buffer([0, 4], [0, 8]).interpolate(instants(1), 10 * MS, cubic=True) == pytest.approx([2])
    assert make_buffer([0, 1, 2], [0, 0, 6]).interpolate(instants(1.5), MS, cubic=True) == pytest.approx([3])


def test_four_samples_are_enough_for_a_cubic_but_it_is_used_on_request_only():
    """The cubic t³ at 1.5 is 3.375; the straight line from 1 to 8 gives 4.5."""
    buffer = make_buffer([0, 1, 2, 3], [0, 1, 8, 27])
    assert buffer.interpolate(instants(1.5), MS, cubic=True) == pytest.approx([3.375])
    assert buffer.interpolate(instants(1.5), MS, cubic=False) == pytest.approx([4.5])


def test_gap_and_age_equal_to_their_limit_are_permitted():
    buffer = make_buffer([0, 10], [0, 10])
    assert buffer.interpolate(instants(5), 10 * MS, cubic=False) == pytest.approx([5])
    assert np.isnan(buffer.interpolate(instants(5), 10 * MS - 1, cubic=False)).all()
    assert buffer.hold_last(instants(20), 10 * MS).tolist() == [10]
    assert np.isnan(buffer.hold_last(instants(20), 10 * MS - 1)).all()


def test_first_sample_may_be_at_time_zero_and_stays_the_start():
    buffer = make_buffer([0], [1])
    assert (buffer.size, buffer.start_ns) == (1, 0)
    buffer.add(instants(3), np.array([2.0]))
    buffer.discard_before(3 * MS)
    assert buffer.start_ns == 0


def test_empty_addition_has_no_start():
    buffer = make_buffer([], [])
    buffer.add(instants(7, 8), np.array([1.0, 2.0]))
    assert (buffer.start_ns, buffer.first_ns, buffer.newest_ns) == (7 * MS, 7 * MS, 8 * MS)


@pytest.mark.parametrize(("before", "first"), [(4, 0), (5, 1), (4.5, 1), (9, 5), (20, 6)])
def test_discarding_keeps_four_older_samples(before, first):
    buffer = make_buffer(range(10), range(10))
    buffer.discard_before(round(before * MS))
    assert (buffer.first_ns, buffer.values[0]) == (first * MS, first)


def test_slope_of_two_samples_is_known_that_of_one_is_zero():
    """Samples more than 5 ms apart are in separate parts."""
    buffer = make_buffer([0, 5, 11], [0.0, 0.01, 7.0])
    assert buffer.differentiate(5 * MS).values == pytest.approx([2.0, 2.0, 0.0])
