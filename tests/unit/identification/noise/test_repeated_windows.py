"""Whole cycles in which motion and drive repeat."""

from dataclasses import replace

import numpy as np
import pytest

from identification.noise.repeated_windows import _choose_length, find_repeated_windows
from identification.signals.motion import estimate_motion
from tests.support.strokes import RATE, recorded, sine, sine_segment, stretch


def find(drive=None, frequency=2.0, seconds=12.0, measured=None):
    displacement, velocity = sine(10e-3, frequency, seconds)
    segments = [sine_segment(0, len(displacement), 10e-3, frequency)]
    given = stretch(recorded(displacement, 2e-6), 800.0 * velocity, drive, segments)
    given = given if measured is None else replace(given, measured=measured)
    motion = estimate_motion(given)
    return find_repeated_windows(given, motion.displacement, motion.noise)


def test_a_constant_drive_is_one_window_without_its_first_cycle():
    (window,) = find()
    assert (window.stop, window.cycles) == (12_000, 23)
    assert window.start == pytest.approx(500, abs=1)
    assert window.period == pytest.approx(500.0, rel=1e-4)
    assert window.motion.shape == (3, window.stop - window.start)
    np.testing.assert_allclose(np.bincount(window.cycle), 500, atol=1)


def test_each_drive_level_is_a_window_without_its_settling():
    noise = 1e-4 * np.random.default_rng(3).standard_normal(12_000)
    windows = find(np.repeat([0.1, 0.5, 0.3], 4000) + noise)
    assert [w.cycles for w in windows] == [7, 7, 7]
    assert [w.stop for w in windows] == [4000, 8000, 12_000]
    assert [w.start for w in windows] == pytest.approx([500, 4500, 8500], abs=1)


def test_a_short_level_loses_half_a_cycle_and_keeps_a_part_of_the_last():
    windows = find(np.repeat([0.1, 0.5, 0.3], 1000), seconds=3.0)
    assert [w.cycles for w in windows] == [2, 2, 2]
    assert [w.stop for w in windows] == [1000, 2000, 3000]
    assert [w.start for w in windows] == pytest.approx([250, 1250, 2250], abs=1)


def test_levels_in_which_too_little_repeats_are_no_windows():
    assert find(np.repeat([0.1, 0.5, 0.3, 0.2], 850), seconds=3.4) == []


@pytest.mark.parametrize(
    ("available", "length"), [(1.7, 1.2), (2.0, 1.5), (2.49, 1.99), (2.5, 2), (4.9, 4), (5.0, 4), (7.9, 6)]
)
def test_a_window_has_whole_cycles_after_one_that_settles_or_a_half(available, length):
    assert _choose_length(available) == pytest.approx(length)


def test_a_drive_that_repeats_with_the_stroke_is_one_window():
    drive = 0.3 + 0.1 * np.sin(2.0 * np.pi * 2.0 * np.arange(12_000) / RATE)
    (window,) = find(drive)
    assert window.cycles == 23


def test_a_drive_that_never_repeats_has_no_window():
    assert find(np.linspace(0.0, 1.0, 12_000)) == []


@pytest.mark.parametrize(("change", "count"), [(0.0019, 1), (0.0021, 2)])
def test_a_drive_repeats_within_two_thousandths_of_its_range(change, count):
    drive = np.zeros(12_000)
    drive[0], drive[6000:] = 1.0, change
    assert len([w for w in find(drive) if w.cycles > 5]) == count


def test_lost_samples_are_marked():
    measured = np.ones(12_000, bool)
    measured[3000:3005] = False
    (window,) = find(measured=measured)
    np.testing.assert_array_equal(np.flatnonzero(~window.valid) + window.start, range(3000, 3005))


def test_a_window_without_measured_force_does_not_count():
    levels, measured = np.repeat([0.1, 0.5, 0.3], 4000), np.ones(12_000, bool)
    measured[4000:8000] = False
    assert [w.stop for w in find(levels, measured=measured)] == [4000, 12_000]
    measured[4000:6500] = True  # five of eight cycles
    assert [w.stop for w in find(levels, measured=measured)] == [4000, 8000, 12_000]
