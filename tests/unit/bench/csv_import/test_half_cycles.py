"""Half cycles, holds and fitted sines of motions whose turning points are known."""

import numpy as np
import pytest

from bench.csv_import.half_cycles import (
    HalfCycle,
    estimate_half_period,
    estimate_min_travel,
    find_half_cycles,
    find_holds,
    find_steady_groups,
    find_true_intervals,
    fit_sine,
)


def make_cycles(amplitudes, step=10.0):
    return [
        HalfCycle(int(step * i), int(step * (i + 1)), amplitude, step * i)
        for i, amplitude in enumerate(amplitudes)
    ]


@pytest.mark.parametrize(
    ("displacement", "travel"),
    [
        (np.linspace(0, 1e-3, 50), 20e-6),
        (np.linspace(0, 0.01, 50), 30e-6),  # 0.3 % of the range
        (np.tile([0.0, 1e-5], 30), 8 * 1.4826 * 2e-5 / 6**0.5),
        (np.zeros(1), 20e-6),
    ],
)
def test_smallest_travel_is_the_largest_of_20_um_a_share_of_the_range_and_eight_times_the_noise(
    displacement, travel
):
    assert estimate_min_travel(displacement) == pytest.approx(travel)


def test_half_cycles_extend_between_turning_points_and_cross_their_middle_between_samples():
    found = find_half_cycles(np.array([0.0, 1, 3, 4, 3, 1, -2, 0, 2]), 1.5)
    assert found == [HalfCycle(0, 3, 2.0, 1.5), HalfCycle(3, 6, 3.0, 5.0), HalfCycle(6, 8, 2.0, 7.0)]


def test_motion_that_begins_downwards_is_found():
    assert find_half_cycles(np.array([0.0, -3, -4, 0]), 1.0) == [
        HalfCycle(0, 2, 2.0, 2 / 3),
        HalfCycle(2, 3, 2.0, 2.5),
    ]


@pytest.mark.parametrize(("back", "stops"), [(1.0, [5]), (1.1, [2, 3, 5])])
def test_return_of_more_than_the_travel_is_a_turning_point(back, stops):
    displacement = np.array([0.0, 2, 4, 4 - back, 5, 6])
    assert [cycle.stop for cycle in find_half_cycles(displacement, 1.0)] == stops


@pytest.mark.parametrize(("size", "count"), [(1.0, 0), (1.1, 1)])
def test_motion_within_the_travel_has_no_half_cycle(size, count):
    assert len(find_half_cycles(np.array([0.0, size]), 1.0)) == count


def test_turning_point_beyond_the_travel_before_the_direction_is_known_starts_at_the_first_sample():
    assert [(c.start, c.stop) for c in find_half_cycles(np.array([0.0, -0.6, 0.6, 5, 0]), 1.0)] == [(0, 3), (3, 4)]


@pytest.mark.parametrize(("rest", "holds"), [(23, []), (24, [(100, 125)]), (59, [(100, 160)])])
def test_a_rest_of_a_quarter_of_a_second_is_a_hold(rest, holds):
    ramp = np.arange(100) * 1e-3  # the second ramp begins with one more sample at rest
    displacement = np.concatenate([ramp, np.full(rest, 0.1), 0.1 + ramp])
    found = find_holds(displacement, [], 1e-5, 100.0)
    assert len(found) == len(holds)
    for interval, expected in zip(found, holds, strict=True):
        assert interval == pytest.approx(expected, abs=2)


def test_holds_at_both_ends_extend_to_the_first_and_the_last_sample():
    displacement = np.concatenate([np.zeros(50), np.arange(50) * 1e-3, np.full(50, 0.05)])
    (first, last) = find_holds(displacement, [], 1e-5, 100.0)
    assert (first[0], last[1]) == (0, 150)


@pytest.mark.parametrize(("length", "count"), [(240, 1), (280, 0)])
def test_a_rest_counts_only_with_forty_percent_of_the_half_cycles_that_it_overlaps(length, count):
    """The rest lasts 100 samples, and the two half cycles that overlap it have the given length together."""
    displacement = np.concatenate([np.arange(300) * 1e-3, np.full(100, 0.3), 0.3 + np.arange(300) * 1e-3])
    half = length // 2
    cycles = [
        HalfCycle(0, 350 - half, 0.1, 0.0),
        HalfCycle(350 - half, 350, 0.1, 0.0),
        HalfCycle(350, 350 + half, 0.1, 0.0),
        HalfCycle(350 + half, 700, 0.1, 0.0),
    ]
    assert len(find_holds(displacement, cycles, 1e-5, 100.0)) == count


def test_true_intervals_include_those_at_both_ends():
    mask = np.array([True, False, True, True, False, True])
    assert find_true_intervals(mask) == [(0, 1), (2, 4), (5, 6)]


@pytest.mark.parametrize(("amplitudes", "sizes"), [
    ([1, 1], []),
    ([1, 1, 1], [3]),
    ([1, 1, 1, 1], [4]),
    ([1, 1, 1, 1, 1.04], [5]),
    ([1, 1, 1, 1, 1.06], [4]),
    ([1, 1, 1, 1, 0.94], [4]),
    ([1, 1, 1, 1, 2, 2, 2, 2], [4, 4]),
    ([1, 1, 3, 2, 2, 2, 2], [4]),
])  # fmt: skip
def test_at_least_three_half_cycles_that_differ_by_at_most_5_percent_are_steady(amplitudes, sizes):
    assert [len(group) for group in find_steady_groups(make_cycles(amplitudes))] == sizes


@pytest.mark.parametrize(("late", "count"), [(0.39, 5), (-0.39, 5), (0.41, 4), (-0.41, 4)])
def test_half_cycle_within_4_percent_of_the_expected_time_continues_a_group(late, count):
    cycles = [*make_cycles([1, 1, 1, 1]), HalfCycle(40, 50, 1.0, 40.0 + late)]
    assert [len(group) for group in find_steady_groups(cycles)] == [count]


def test_last_half_cycle_of_a_group_begins_the_next_one_if_its_amplitude_fits():
    cycles = make_cycles([1, 1, 1, 1])
    cycles += [HalfCycle(0, 0, 1.0, 30.0 + 20.0 * i) for i in range(1, 4)]
    groups = find_steady_groups(cycles)
    assert [[cycle.middle for cycle in group] for group in groups] == [[0, 10, 20, 30], [30, 50, 70, 90]]
    assert [estimate_half_period(group) for group in groups] == [10.0, 20.0]


def test_sine_with_offset_is_fitted_and_evaluated_at_other_samples():
    samples = np.arange(60)
    motion = 0.5 + 3 * np.sin(np.pi * samples / 10 + 0.3)
    motion[40:] = 0.0
    fit = fit_sine(motion, 10.0, slice(5, 35), slice(40, 60))
    assert (fit.amplitude, fit.misfit) == pytest.approx((3.0, 0.0), abs=1e-9)
    assert fit.curve == pytest.approx(0.5 + 3 * np.sin(np.pi * samples[40:] / 10 + 0.3))


def test_misfit_is_the_rms_residual_over_the_amplitude():
    samples = np.arange(40)
    motion = 2 * np.sin(np.pi * samples / 10) + 0.1 * np.sin(np.pi * samples / 5)
    assert fit_sine(motion, 10.0, slice(0, 40), slice(0, 0)).misfit == pytest.approx(0.05 / 2**0.5)
