import subprocess
import sys

import numpy as np
import pytest

from bench.log.velocity import smooth_velocity


@pytest.mark.parametrize("rate", [200.0, 1000.0, 5000.0])
def test_velocity_of_a_sine_is_within_half_a_percent_at_any_rate(rate):
    time = np.arange(int(2 * rate)) / rate
    velocity = smooth_velocity(0.01 * np.sin(2 * np.pi * 2 * time), rate)

    peak = 0.01 * 2 * np.pi * 2
    expected = peak * np.cos(2 * np.pi * 2 * time)
    inner = slice(len(time) // 10, -len(time) // 10)
    assert np.max(np.abs(velocity - expected)[inner]) < 0.005 * peak


def test_noise_of_displacement_is_smoothed():
    noise = np.random.default_rng(2).normal(0, 3e-6, 5000)

    assert np.std(smooth_velocity(noise, 1000.0)) < 0.1 * np.std(np.gradient(noise, 0.001))


@pytest.mark.parametrize("samples", [0, 1])
def test_velocity_of_fewer_than_two_samples_is_zero(samples):
    assert smooth_velocity(np.ones(samples), 1000.0).tolist() == [0.0] * samples


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_velocity_of_a_few_samples_is_their_slope(samples):
    displacement = 0.5 * np.arange(samples) / 100.0

    np.testing.assert_allclose(smooth_velocity(displacement, 100.0), 0.5)


@pytest.mark.parametrize(("rate", "half", "slope"), [(100.0, 2, 3.4), (1000.0, 10, 65.8)])
def test_window_is_20_ms_and_at_least_five_samples(rate, half, slope):
    """The parabola fitted to i³ has at its middle the slope sum(i⁴) / sum(i²), which depends on the window."""
    cube = np.arange(-half - 3, half + 4, dtype=float) ** 3

    assert smooth_velocity(cube, rate)[half + 3] == pytest.approx(slope * rate)


@pytest.mark.parametrize("samples", [5, 8, 9])
def test_velocity_of_a_parabola_is_exact_up_to_both_ends(samples):
    time = np.arange(samples) / 1000

    np.testing.assert_allclose(smooth_velocity(3 * time**2, 1000.0), 6 * time, atol=1e-12)


@pytest.mark.parametrize(("samples", "slope"), [(6, 3.4), (7, 7.0)])
def test_window_in_a_short_recording_is_its_largest_odd_number_of_samples(samples, slope):
    cube = (np.arange(samples) - (samples - 1) // 2.0) ** 3

    assert smooth_velocity(cube, 1000.0)[(samples - 1) // 2] == pytest.approx(slope * 1000)


def test_reading_logs_loads_no_signal_processing():
    code = "import sys, bench.log; print([m for m in ('scipy.signal', 'scipy.stats') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
