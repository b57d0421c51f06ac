"""Statistics of a channel at rest: mean, deviation, and the uncertainty with correlated samples."""

import numpy as np
import pytest

from bench.checks import compute_statistics, estimate_correlation


def make_correlated(phi, samples, seed):
    """Return a first-order autoregression, whose correlation is (1 + phi) / (1 - phi)."""
    noise = np.random.default_rng(seed).normal(size=samples)
    values = np.empty(samples)
    values[0] = noise[0] / (1 - phi**2) ** 0.5
    for index in range(1, samples):
        values[index] = phi * values[index - 1] + noise[index]
    return values


def test_mean_and_deviation_agree_with_hand_calculation():
    # Mean 2; squares of the deviations 1, 1, 1, 1, 0 over 4.
    statistics = compute_statistics(np.array([1.0, 3.0, 1.0, 3.0, 2.0]))
    assert (statistics.mean, statistics.standard_deviation, statistics.samples) == (2.0, 1.0, 5)
    # The values alternate, which would count as more than five independent ones.
    assert statistics.independent_samples == 5
    assert statistics.standard_uncertainty == pytest.approx(1 / 5**0.5)


def test_white_noise_is_independent():
    assert estimate_correlation(np.random.default_rng(1).normal(size=20_000)) == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize(("phi", "expected"), [(0.5, 3.0), (0.9, 19.0), (0.98, 99.0)])
def test_correlation_of_an_autoregression(phi, expected):
    assert estimate_correlation(make_correlated(phi, 100_000, 2)) == pytest.approx(expected, rel=0.15)


def test_the_uncertainty_of_correlated_samples_is_the_scatter_of_their_mean():
    all_statistics = [compute_statistics(make_correlated(0.9, 5_000, seed)) for seed in range(100)]
    scatter = np.std([one.mean for one in all_statistics], ddof=1)
    stated = np.sqrt(np.mean([one.standard_uncertainty**2 for one in all_statistics]))
    # The scatter of 100 means is known to 7 %.
    assert stated == pytest.approx(scatter, rel=0.25)


def test_equal_samples_count_as_one_and_have_no_scatter():
    statistics = compute_statistics(np.full(100, 3.0))
    assert (statistics.standard_deviation, statistics.independent_samples) == (0.0, 1.0)
    assert statistics.standard_uncertainty == 0.0


def test_a_drift_counts_as_correlation():
    values = np.linspace(0, 1, 1000)
    assert compute_statistics(values).independent_samples < 5
