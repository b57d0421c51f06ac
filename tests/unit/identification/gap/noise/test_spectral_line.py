"""The mains frequency in the residual of a fit."""

import numpy as np
import pytest

from identification.gap.noise.spectral_line import MAINS_FREQUENCY, find_mains_frequency

TIME = np.arange(5000) / 500.0


@pytest.mark.parametrize("frequency", [49.7, 50.0, 60.1])
def test_the_strongest_line_near_the_mains_frequency_is_found(frequency):
    error = 2.0 * np.sin(2.0 * np.pi * frequency * TIME) + 9.0 * np.sin(2.0 * np.pi * 12.0 * TIME)
    assert find_mains_frequency(error, 500.0) == pytest.approx(frequency, abs=0.02)


def test_a_slow_recording_gets_the_usual_frequency():
    assert find_mains_frequency(np.zeros(100), 100.0) == MAINS_FREQUENCY
