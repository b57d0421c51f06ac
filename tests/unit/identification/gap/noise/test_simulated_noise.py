"""Noise with the spectrum of a residual."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.noise.simulated_noise import compute_noise_evidence, simulate_noise
from tests.support.noise import make_pink_noise, make_residual


def test_simulated_noise_has_the_power_of_the_residual_in_each_octave_but_other_phases():
    slow = make_pink_noise(8192, default_rng(4))
    noise = simulate_noise(make_residual(slow), 8, 20.0)
    powers = [np.mean(np.abs(np.fft.rfft(values, axis=0)) ** 2, axis=-1) for values in (slow[:, None], noise)]
    highest = 1638  # 20 Hz of 8192 samples at 100 Hz
    assert powers[1][highest + 1 :].max() < 1e-12
    for octave in range(5, 10):
        bins = slice(2**octave, 2 ** (octave + 1))
        assert np.mean(powers[1][bins]) == pytest.approx(np.mean(powers[0][bins]), rel=0.3)
    assert np.abs(np.corrcoef(np.column_stack([slow, noise]).T)[0, 1:]).max() < 0.6


def test_without_a_limit_the_noise_has_the_size_of_the_residual_and_is_stationary():
    bursts = default_rng(1).standard_normal(8192) * (np.arange(8192) // 1024 % 4 == 0)
    noise = simulate_noise(make_residual(bursts), 16)
    assert noise.shape == (8192, 16)
    assert np.mean(noise**2) == pytest.approx(np.mean(bursts**2), rel=0.05)
    parts = np.mean(noise.reshape(8, 1024, 16) ** 2, axis=(1, 2))
    assert parts.max() < 1.2 * parts.min()
    assert np.array_equal(noise, simulate_noise(make_residual(bursts), 16))


def test_the_evidence_in_white_noise_is_half_the_squared_change_over_the_noise():
    residual = make_residual(default_rng(1).standard_normal(8192))
    for frequency in (0.05, 3.0):
        change = 0.1 * np.sin(2 * np.pi * frequency * residual.time)
        assert compute_noise_evidence(residual, change) == pytest.approx(0.5 * 8192 * 0.005, rel=0.3)
    assert compute_noise_evidence(residual, change + 7.0) == pytest.approx(
        compute_noise_evidence(residual, change)
    )


def test_slow_noise_leaves_little_evidence_for_a_slow_change():
    residual = make_residual(make_pink_noise(8192, default_rng(4)))
    slow, fast = (0.5 * np.sin(2 * np.pi * f * residual.time) for f in (0.05, 20.0))
    assert compute_noise_evidence(residual, slow) < 10.0
    assert compute_noise_evidence(residual, fast) > 500.0


@pytest.mark.parametrize("frequency", [0.0122, 0.2])
def test_the_evidence_is_that_of_many_series_of_slow_noise(frequency):
    random = default_rng(4)
    series = [make_residual(make_pink_noise(8192, random)) for _ in range(200)]
    change = 0.5 * np.sin(2 * np.pi * frequency * np.arange(8192) / 100.0)
    factors = [residual.values @ change / (change @ change) for residual in series]
    inverse = np.mean([1.0 / compute_noise_evidence(residual, change) for residual in series])
    assert 1.0 / inverse == pytest.approx(0.5 / np.mean(np.square(factors)), rel=0.25)
