"""Plateaus of a drive: windows, tolerance, and the sample of a step."""

import numpy as np
import pytest

from bench.csv_import.plateaus import Plateau, find_edge, find_plateaus


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [
        (0, 99, (10, 20)),
        (12, 15, (12, 15)),
        (15, 99, (15, 20)),
        (0, 12, (10, 12)),
        (0, 5, (5, 5)),
        (30, 40, (30, 30)),
    ],
)
def test_clipped_plateau_is_its_part_between_two_samples(start, stop, expected):
    clipped = Plateau(10, 20, 0.3).clip(start, stop)
    assert (clipped.start, clipped.stop, clipped.level) == (*expected, 0.3)
    assert len(clipped) == expected[1] - expected[0]


@pytest.mark.parametrize(("rate", "size"), [(500.0, 9), (2000.0, 20)])
def test_windows_of_10_ms_and_at_least_nine_samples_divide_a_drive(rate, size):
    drive = np.repeat([0.0, 1.0, 0.0], [3 * size, 2 * size, 4 * size + 1])
    found, tolerance = find_plateaus(drive, rate)
    bounds = [(p.start, p.stop, p.level) for p in found]
    assert bounds == [(0, 3 * size, 0.0), (3 * size, 5 * size, 1.0), (5 * size, 9 * size + 1, 0.0)]
    assert tolerance == 0.02


def test_drive_shorter_than_a_window_is_one_plateau():
    assert find_plateaus(np.array([0.1, 0.2, 0.9]), 500.0)[0] == [Plateau(0, 3, 0.2)]


@pytest.mark.parametrize(
    ("medians", "tolerance"),
    [
        ([0.1, 0.1, 0.1], 0.005),  # never below 5 mV
        ([1.0, 1.0, 1.0], 0.02),  # at least 2 % of the largest
        ([-2.0, -2.0, -2.0], 0.04),
        ([1.0, 1.007, 1.0, 1.007], 4 * 1.4826 * 0.007 / 2**0.5),
        ([1.0, 1.1, 1.0, 1.1], 0.044),  # at most 4 %
    ],
)
def test_tolerance_is_four_deviations_of_a_median_within_2_and_4_percent(medians, tolerance):
    assert find_plateaus(np.repeat(medians, 9), 500.0)[1] == pytest.approx(tolerance)


@pytest.mark.parametrize(("step", "count"), [(0.019, 1), (0.021, 2)])
def test_windows_that_differ_by_more_than_the_tolerance_are_two_plateaus(step, count):
    assert len(find_plateaus(np.repeat([1.0, 1.0, 1.0, 1.0 - step], 9), 500.0)[0]) == count


def test_slow_drift_is_compared_with_the_mean_of_the_plateau_so_far():
    """Means of 1, 0.99, 0.98 are within 2 % of the next window, 0.965 is not within 2 % of the first one."""
    found, _ = find_plateaus(np.repeat([1.0, 1.0, 0.985, 0.985, 0.98, 0.965], 9), 500.0)
    assert [(p.start, p.stop) for p in found] == [(0, 45), (45, 54)]


@pytest.mark.parametrize(("levels", "edge"), [((0.0, 1.0), 12), ((1.0, 0.0), 12)])
def test_edge_is_the_first_sample_beyond_the_mean_of_the_levels(levels, edge):
    left, right = levels
    drive = np.concatenate(
        [np.full(10, left), [0.9 * left + 0.1 * right, 0.6 * left + 0.4 * right], np.full(18, right)]
    )
    assert find_edge(drive, Plateau(0, 10, left), Plateau(10, 30, right)) == edge


def test_edge_without_a_sample_before_it_is_the_middle_of_the_left_plateau():
    assert find_edge(np.ones(30), Plateau(0, 10, 0.0), Plateau(10, 30, 1.0)) == 5


def test_edge_after_the_middle_of_the_right_plateau_is_not_searched():
    drive = np.zeros(40)
    assert find_edge(drive, Plateau(0, 10, 0.0), Plateau(10, 30, 1.0)) == 21
