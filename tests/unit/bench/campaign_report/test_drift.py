"""Drift and outliers of a series against least squares."""

import numpy as np
import pytest
from scipy import stats

from bench.campaign_report.drift import Z95, find_outliers, fit_drift

HOURS = [0.0, 1.0, 2.5, 4.0, 6.0]


def test_a_drift_has_the_interval_of_weighted_least_squares_where_the_scatter_is_small():
    values = [10.0, 12.1, 14.9, 18.0, 22.1]
    found = fit_drift(HOURS, values, [2.0] * 5)
    design = np.column_stack([np.ones(5), HOURS])
    covariance = np.linalg.inv(design.T @ design) * (2.0 / Z95) ** 2
    assert found.slope == pytest.approx(stats.linregress(HOURS, values).slope)
    assert found.half_width == pytest.approx(Z95 * np.sqrt(covariance[1, 1]))
    assert found.is_significant


def test_values_that_scatter_more_than_they_state_have_a_wider_interval():
    values = [10.0, 17.0, 9.0, 18.0, 12.0]
    found = fit_drift(HOURS, values, [0.1] * 5)
    expected = stats.linregress(HOURS, values)
    assert found.half_width == pytest.approx(stats.t.ppf(0.975, 3) * expected.stderr)
    assert found.widening > 100
    assert not found.is_significant


@pytest.mark.parametrize(
    ("x", "halves"), [([0.0, 1.0], [1.0, 1.0]), ([0.0, 1.0, 2.0], [1.0, None, 1.0]), ([2.0] * 3, [1.0] * 3)]
)
def test_there_is_no_drift_without_three_intervals_at_different_places(x, halves):
    assert fit_drift(x, [1.0] * len(x), halves) is None


def test_an_outlier_is_found_from_five_runs_on():
    values = [2630.0, 2631.0, 2629.5, 2700.0, 2630.5, 2629.0]
    assert find_outliers(range(6), values, [4.0] * 6) == [3]
    assert find_outliers(range(4), values[:4], [4.0] * 4) == []
    assert find_outliers(range(6), values, [4.0, 4.0, 4.0, None, 4.0, 4.0]) == []
