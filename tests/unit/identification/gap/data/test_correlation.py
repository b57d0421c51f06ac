"""Correlation length of a residual."""

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data import compute_correlation_length


def test_white_noise_has_the_length_of_about_one_sample():
    assert compute_correlation_length(default_rng(1).standard_normal(20_000)) == pytest.approx(1.0, abs=0.15)


def test_slow_noise_has_the_length_of_its_autocorrelation():
    # First order with the coefficient 0.9: the sum of its autocorrelation is (1 + 0.9) / (1 - 0.9) = 19.
    slow = lfilter([1.0], [1.0, -0.9], default_rng(2).standard_normal(200_000))
    assert compute_correlation_length(slow) == pytest.approx(19.0, rel=0.2)


def test_a_series_of_zeros_has_the_length_one():
    assert compute_correlation_length(np.zeros(50)) == 1.0
