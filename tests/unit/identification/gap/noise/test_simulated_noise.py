"""Noise with the spectrum of a residual."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.noise.simulated_noise import simulate_noise
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
