"""Correlation length of a residual."""

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data import compute_correlation_length, compute_residual_correlation_length


def test_white_noise_has_the_length_of_about_one_sample():
    assert compute_correlation_length(default_rng(1).standard_normal(20_000)) == pytest.approx(1.0, abs=0.15)


def test_slow_noise_has_the_length_of_its_autocorrelation():
    # First order with the coefficient 0.9: the sum of its autocorrelation is (1 + 0.9) / (1 - 0.9) = 19.
    slow = lfilter([1.0], [1.0, -0.9], default_rng(2).standard_normal(200_000))
    assert compute_correlation_length(slow) == pytest.approx(19.0, rel=0.2)


def test_a_series_of_zeros_has_the_length_one():
    assert compute_correlation_length(np.zeros(50)) == 1.0


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.97])
def test_the_correlation_length_of_an_autoregression_has_its_known_value(memory):
    random = default_rng(8)
    values = np.zeros(60_000)
    for i, noise in enumerate(random.standard_normal(len(values) - 1), 1):
        values[i] = memory * values[i - 1] + noise
    length = compute_residual_correlation_length([values])
    assert length == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.15)


def test_the_correlation_length_is_that_of_the_longest_piece_and_ignores_its_mean():
    short, long = np.ones(50), default_rng(9).standard_normal(5000)
    assert compute_residual_correlation_length([short, 1e3 + long]) == pytest.approx(1.0, abs=0.15)
    assert compute_residual_correlation_length([np.full(20, 3.0)]) == 1.0
