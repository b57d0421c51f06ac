"""95 % intervals stay inside the bounds and contain the value."""

import numpy as np
import pytest

from identification.gap.outcome.interval import compute_interval


def test_a_size_that_can_be_zero_has_a_symmetric_interval():
    assert compute_interval(5.0, 1.0, -100.0, 100.0) == pytest.approx((3.04, 6.96))


def test_a_positive_parameter_has_an_interval_on_the_logarithm():
    low, high = compute_interval(5.0, 2.0, 0.1, 100.0)
    assert low * high == pytest.approx(25.0)
    assert 0.1 < low < 5.0 < high


def test_the_bounds_limit_the_interval():
    assert compute_interval(0.5, 1.0, 0.0, 1.0) == (0.0, 1.0)
    assert compute_interval(0.5, 1.0, 0.1, 1.0) == (0.1, 1.0)


def test_an_undetermined_parameter_has_the_bounds_as_interval():
    assert compute_interval(0.5, np.inf, 0.0, 1.0) == (0.0, 1.0)
