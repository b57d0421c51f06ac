"""Parts of a force that the fit of a window removes and leaves."""

import numpy as np
import pytest

from identification.noise.repeated_windows import RepeatedWindow
from identification.noise.window_fit import CycleFit, WindowFit

RNG = np.random.default_rng(3)


def make_window(cycles=8, period=250.4, force=None, motion=None, valid=None):
    count = int(cycles * period)
    angle = 2.0 * np.pi * np.arange(count) / period
    exact = np.stack([np.sin(angle), np.cos(angle), -np.sin(angle)])
    return RepeatedWindow(
        500,
        period,
        cycles,
        100.0 * np.sign(np.cos(angle)) if force is None else force(angle),
        exact if motion is None else motion(angle),
        np.ones(count, bool) if valid is None else valid,
    )


def leave(window):
    return WindowFit(CycleFit(window)).remove(window.force[:, None])[:, 0]


def test_a_cycle_that_fades_leaves_nothing():
    window = make_window(force=lambda a: (1.0 - 0.02 * a / a[-1]) * 100.0 * np.tanh(9.0 * np.cos(a)))
    assert np.abs(leave(window)).max() < 0.05


def test_force_that_follows_the_change_of_the_motion_is_removed():
    def change(angle):
        return 1e-3 * np.interp(angle, 2.0 * np.pi * np.arange(9), np.random.default_rng(1).standard_normal(9))

    def move(angle):
        x = np.sin(angle) * (1.0 + change(angle))
        return np.stack([x, np.cos(angle), -np.sin(angle)])

    window = make_window(force=lambda a: 5e4 * np.sin(a) * (1.0 + change(a)), motion=move)
    assert np.std(leave(window)) < 0.02 * np.std(CycleFit(window).remove(window.force[:, None]))


def test_the_gain_is_zero_at_the_harmonics_and_one_between_them():
    fit = WindowFit(CycleFit(make_window(cycles=8, period=250.0)))
    bins = np.arange(len(fit.gain))
    harmonics = (bins % 8 == 0) & (bins < 800)
    assert fit.gain[harmonics].max() < 0.05
    # Beyond 16 harmonics the change within the window no longer takes the neighbours.
    between = (bins % 8 == 4) & (bins > 200) & (bins < 900)
    assert fit.gain[between].mean() == pytest.approx(1.0, abs=0.06)


def test_the_gain_of_a_long_window_needs_fewer_series():
    window = make_window(cycles=40, period=1000.0)
    assert WindowFit(CycleFit(window)).gain[1:].mean() == pytest.approx(1.0 - 1.0 / 40.0, abs=0.02)


def test_invalid_samples_are_left_out_and_become_zero():
    valid = np.ones(2003, bool)
    valid[700:720] = False
    window = make_window(valid=valid)
    window.force[700:720] = 1e6
    remainder = leave(window)
    assert np.abs(remainder[~valid]).max() == 0.0
    assert np.std(remainder) < np.std(window.force[valid]) / 10.0


def test_the_motion_difference_is_that_of_each_cycle():
    late = np.where(np.arange(2003) // 250.4 == 3, 1e-3, 0.0)
    window = make_window(motion=lambda a: np.stack([np.sin(a) + late, np.cos(a), -np.sin(a)]))
    difference = CycleFit(window).measure_motion_difference()
    assert len(difference) == 8
    assert np.argmax(difference) == 3
    assert difference[3] == pytest.approx(7.0 / 8.0 * 1e-3, rel=0.3)
