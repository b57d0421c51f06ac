"""Normal equations of harmonics against a table of harmonics by samples."""

import numpy as np
import pytest

from identification.signals.harmonic_sums import evaluate_harmonics, make_normal_equations


def make_table(samples, count, step):
    """Return the table (2 + 2 count, samples) of offset, slope and harmonics."""
    position = np.arange(samples) - 0.5 * samples
    angle = 2.0 * np.pi * step * position
    waves = [wave(k * angle) for k in range(1, count + 1) for wave in (np.cos, np.sin)]
    return np.array([np.ones(samples), position / (0.5 * samples), *waves])


@pytest.mark.parametrize(("samples", "count", "step"), [(1000, 3, 0.005), (501, 20, 0.0123), (8, 1, 0.125)])
def test_the_sums_are_the_products_of_the_table(samples, count, step):
    random = np.random.default_rng(3)
    values, weights = random.standard_normal(samples), (random.random(samples) > 0.2).astype(float)
    table = make_table(samples, count, step)
    found = make_normal_equations(values, weights, count, step)
    np.testing.assert_allclose(found.matrix, (table * weights) @ table.T, atol=1e-11 * samples)
    np.testing.assert_allclose(found.moments, (table * weights) @ values, atol=1e-11 * samples)


def test_weights_other_than_one_count_once():
    values, weights = np.arange(40.0), np.linspace(0.1, 3.0, 40)
    table = make_table(40, 2, 0.05)
    found = make_normal_equations(values, weights, 2, 0.05)
    np.testing.assert_allclose(found.matrix, (table * weights) @ table.T, atol=1e-9)
    np.testing.assert_allclose(found.moments, (table * weights) @ values, atol=1e-9)


def test_a_signal_is_that_of_its_amplitudes():
    amplitudes = np.array([5.0, -2.0, 1.0, 0.5, 0.0, 0.0, -0.3, 0.8])
    expected = amplitudes @ make_table(300, 3, 0.011)
    np.testing.assert_allclose(evaluate_harmonics(amplitudes, 300, 0.011), expected, atol=1e-12)
    amplitudes[6:] = 0.0
    expected = amplitudes @ make_table(300, 3, 0.011)
    np.testing.assert_allclose(evaluate_harmonics(amplitudes, 300, 0.011), expected, atol=1e-12)
