"""Sampling clock: stamps that are rounded or late are replaced, all others are kept."""

import numpy as np
import pytest

from bench.csv_import.sampling_clock import compute_noise, find_resolution, restore_sampling_clock

RATE = 400.0
"""[Hz]"""
EXACT = np.arange(4000) / RATE
"""[s]"""
NOISE = 1e-6
"""[m]"""


def move(time):
    """Return a displacement [m] with noise: 5 mm at 2 Hz, 63 mm/s."""
    return 5e-3 * np.sin(4 * np.pi * time) + NOISE * np.random.default_rng(1).standard_normal(len(time))


@pytest.mark.parametrize("resolution", [1e-3, 1e-2])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize("convert", [np.rint, np.floor])
def test_rounded_stamps_become_uniform(resolution, start, convert):
    clock = restore_sampling_clock(convert((EXACT + start) / resolution) * resolution, move(EXACT))

    np.testing.assert_allclose(np.diff(clock.time), 1 / RATE, rtol=1e-3)
    assert (
        clock.note
        == f"the time stamps are rounded to {resolution:g} s; the samples are taken as uniform, 0.0025 s apart"
    )


def test_late_stamps_become_uniform_where_the_displacement_is():
    late = EXACT + np.random.default_rng(2).uniform(0, 0.5e-3, len(EXACT))

    clock = restore_sampling_clock(late, move(EXACT))

    np.testing.assert_allclose(np.diff(clock.time), 1 / RATE, rtol=1e-3)
    assert "deviate from a uniform clock by up to 0.00025 s" in clock.note


def test_uneven_samples_with_exact_stamps_are_kept():
    uneven = EXACT + np.random.default_rng(2).uniform(0, 0.5e-3, len(EXACT))

    clock = restore_sampling_clock(uneven, move(uneven))

    np.testing.assert_array_equal(clock.time, uneven)
    assert not clock.note


def test_exact_stamps_are_kept():
    clock = restore_sampling_clock(EXACT, move(EXACT))

    np.testing.assert_array_equal(clock.time, EXACT)
    assert not clock.note


def test_a_gap_is_kept():
    gap = np.where(EXACT > 5.0, EXACT + 0.5, EXACT)

    clock = restore_sampling_clock(np.round(gap, 4), move(gap))

    np.testing.assert_array_equal(clock.time, np.round(gap, 4))


@pytest.mark.parametrize(("step", "resolution"), [(0.25, 0.01), (2.0, 1.0), (1e-6, 1e-6), (np.pi, 0.0)])
def test_the_resolution_is_the_coarsest_decimal_unit(step, resolution):
    assert find_resolution(step * np.arange(300)) == pytest.approx(resolution)


def test_the_noise_is_that_of_the_displacement_on_even_and_on_uneven_instants():
    uneven = EXACT + np.random.default_rng(2).uniform(0, 1e-3, len(EXACT))

    for time in (EXACT, uneven):
        assert compute_noise(move(time), time) == pytest.approx(NOISE, rel=0.1)
