"""White noise from fourth differences."""

import numpy as np
import pytest

from identification.noise.high_frequency import estimate_high_frequency_noise


@pytest.mark.parametrize(("digit", "noise"), [(0.0, 2.5), (0.5, 2.5), (3.0, 2.5)])
def test_high_frequency_noise_contains_the_digits_of_the_force(digit, noise):
    force = noise * np.random.default_rng(0).standard_normal(40_000) + 50.0 * np.sin(np.arange(40_000) / 300.0)
    force = np.round(force / digit) * digit if digit else force
    assert estimate_high_frequency_noise(force) == pytest.approx((noise**2 + digit**2 / 12) ** 0.5, rel=0.02)


def test_a_force_of_few_digits_has_the_noise_of_its_smooth_steps():
    assert estimate_high_frequency_noise(np.repeat([0.0, 100.0], 500)) < 30.0
