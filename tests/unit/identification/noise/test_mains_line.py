"""Mains line in what the windows leave of the force."""

import numpy as np
import pytest

from identification.noise.mains_line import find_mains_line
from identification.noise.repeated_windows import RepeatedWindow
from identification.noise.window_fit import CycleFit, WindowFit

RATE = 500.0


def find(line, rate=RATE, windows=4, count=1500):
    """Find a line in white noise of 1 N; the windows are half their length apart."""
    fits, remainders = [], []
    for k in range(windows):
        start = round(1.5 * k * count)
        time = np.arange(start, start + count) / rate
        angle = 2.0 * np.pi * np.arange(count) / 250.0
        motion = np.stack([np.sin(angle), np.cos(angle), -np.sin(angle)])
        force = line(time) + np.random.default_rng(k).standard_normal(count)
        fit = WindowFit(CycleFit(RepeatedWindow(start, 250.0, 6, force, motion, np.ones(count, bool))))
        fits.append(fit)
        remainders.append(fit.remove(force[:, None])[:, 0])
    return find_mains_line(fits, remainders, rate)


@pytest.mark.parametrize("frequency", [47.3, 50.7, 60.5])
def test_a_line_with_one_phase_is_found_and_removed(frequency):
    found = find(lambda t: 2.0 * np.sin(2.0 * np.pi * frequency * t + 0.4))
    assert found.frequency == pytest.approx(frequency, abs=0.02)
    assert found.deviation == pytest.approx(2.0**0.5, rel=0.1)
    assert np.std(np.concatenate(found.remainders)) < 1.02


@pytest.mark.parametrize("frequency", [50.1, 50.2, 50.25, 60.15])
def test_a_line_beside_a_harmonic_of_the_stroke_is_found_at_its_own_frequency(frequency):
    """The fits remove most of such a line, and leave more beside it than at its frequency."""
    found = find(lambda t: 15.0 * np.sin(2.0 * np.pi * frequency * t + 0.4))
    assert found.frequency == pytest.approx(frequency, abs=0.01)
    assert found.deviation == pytest.approx(15.0 * 0.5**0.5, rel=0.1)
    assert np.std(np.concatenate(found.remainders)) < 1.05


def test_the_third_harmonic_is_removed_with_it():
    found = find(lambda t: np.sin(2.0 * np.pi * 50.8 * t) + 1.5 * np.cos(6.0 * np.pi * 50.8 * t))
    assert np.std(np.concatenate(found.remainders)) < 1.02
    assert found.deviation == pytest.approx(((1.0 + 2.25) / 2.0) ** 0.5, rel=0.1)


@pytest.mark.parametrize("frequency", [45.1, 54.7, 63.1])
def test_lines_outside_the_range_of_the_mains_are_noise(frequency):
    found = find(lambda t: 2.0 * np.sin(2.0 * np.pi * frequency * t))
    # What leaks into the range from such a line is small.
    assert found is None or found.deviation < 0.2


def test_noise_alone_has_no_line():
    assert find(np.zeros_like) is None


def test_a_rate_that_cannot_show_the_mains_has_no_line():
    assert find(lambda t: 2.0 * np.sin(2.0 * np.pi * 50.8 * t), rate=123.0) is None


def test_a_line_near_half_the_sampling_rate_stays_where_it_can_be_seen():
    """The frequency of this line is refined to one that the fits remove."""
    found = find(lambda t: 2.0 * np.sin(2.0 * np.pi * 61.8 * t), rate=124.5)
    assert found.frequency == pytest.approx(61.8, abs=0.05)
    assert np.isfinite(np.concatenate(found.remainders)).all()


def test_no_window_has_no_line():
    assert find_mains_line([], [], RATE) is None


def test_windows_that_are_too_short_show_no_line():
    assert find(lambda t: 2.0 * np.sin(2.0 * np.pi * 50.1 * t), windows=1, count=500) is None
