"""Variance of a signal by time scale."""

import math

import numpy as np
import pytest

from identification.noise.time_scales import (
    NO_SLOW_VARIANCE,
    ScaleVariance,
    average_scales,
    compute_gain,
    estimate_slow_variance,
    list_scales,
    measure_scale_variance,
)


def test_white_noise_has_half_of_its_variance_at_each_scale_that_is_left():
    white = np.random.default_rng(1).standard_normal(200_000)
    valid = np.ones(len(white), bool)
    for samples in (1, 2, 4, 8, 16):
        variance, count = measure_scale_variance(white, valid, samples)
        assert variance == pytest.approx(0.5 / samples, rel=5.0 * np.sqrt(4.0 * samples / count))


def test_the_gain_is_that_of_the_measured_differences():
    number = np.arange(40_000)
    for frequency in (0.002, 0.03, 0.2):
        wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * frequency * number)
        for samples in (1, 4, 16):
            measured, _ = measure_scale_variance(wave, np.ones(len(wave), bool), samples)
            assert measured == pytest.approx(compute_gain(np.array([frequency]), samples)[0], rel=0.02, abs=1e-9)


def test_the_scales_add_up_to_the_variance():
    frequency = np.array([0.01, 0.1, 0.4])
    total = sum(compute_gain(frequency, 2**j) for j in range(14))
    assert total == pytest.approx(np.ones(3), abs=1e-3)


def test_a_constant_has_no_power_at_any_scale():
    assert compute_gain(np.zeros(1), 8) == pytest.approx(0.0, abs=1e-20)
    assert measure_scale_variance(np.full(100, 3.0), np.ones(100, bool), 8)[0] == pytest.approx(0.0, abs=1e-20)


def test_differences_with_an_invalid_sample_do_not_count():
    values, valid = np.zeros(100), np.ones(100, bool)
    values[40], valid[40] = 1e6, False
    variance, count = measure_scale_variance(values, valid, 5)
    assert variance == 0.0
    assert count == 100 - 10 + 1 - 10
    assert measure_scale_variance(values, np.zeros(100, bool), 5) == (0.0, 0)
    assert measure_scale_variance(values[:9], valid[:9], 5) == (0.0, 0)


def test_a_signal_has_scales_of_which_it_contains_some_differences():
    assert list(list_scales(1000)) == [1, 2, 4, 8, 16, 32]
    assert list(list_scales(10)) == []


def test_signals_are_averaged_at_the_scales_of_all():
    first = [ScaleVariance(1, 4.0, 0.4), ScaleVariance(2, 2.0, 0.2)]
    second = [ScaleVariance(1, 8.0, 0.4)]
    (mean,) = average_scales([first, second], [300, 100])
    assert mean == pytest.approx(ScaleVariance(1, 5.0, np.hypot(0.3, 0.1)))


def test_a_stronger_signal_is_stronger_at_every_scale():
    assert ScaleVariance(4, 2.0, 0.2, 0.1).multiply(3.0) == pytest.approx(ScaleVariance(4, 6.0, 0.6, 0.3))


def make_scales(*variances):
    """Scales with the variances by chance of a signal of 1000 samples."""
    scales = [ScaleVariance(2**k, v, 0.0) for k, v in enumerate(variances)]
    return [s._replace(deviation=s.compute_chance(1000)) for s in scales]


def test_slow_noise_is_what_the_longest_scales_have_in_common():
    assert estimate_slow_variance(make_scales(*[0.7] * 6)).variance == pytest.approx(0.7 / math.log(2.0))
    assert estimate_slow_variance(make_scales(*(0.5**k for k in range(6)))).variance == pytest.approx(
        0.0, abs=1e-9
    )
    mixed = make_scales(*(0.2 + 4.0 * 0.5**k for k in range(6)))
    assert estimate_slow_variance(mixed).variance == pytest.approx(0.2 / math.log(2.0))


def test_a_longest_scale_that_is_small_by_chance_does_not_decide():
    assert estimate_slow_variance(make_scales(*[0.7] * 5, 0.05)).variance > 0.5


def test_slow_noise_of_unknown_scales_is_zero():
    assert estimate_slow_variance(()) == NO_SLOW_VARIANCE
    assert estimate_slow_variance(make_scales(0.0, 0.0)) == NO_SLOW_VARIANCE


def test_slow_variance_has_the_standard_deviation_of_its_estimates():
    random = np.random.default_rng(11)
    true = make_scales(*(0.7 + 30.0 * 0.5**k for k in range(6)))
    found = [
        estimate_slow_variance([s._replace(variance=abs(random.normal(s.variance, s.deviation))) for s in true])
        for _ in range(400)
    ]
    spread = np.std([f.variance for f in found])
    assert np.median([f.deviation for f in found]) == pytest.approx(spread, rel=0.25)
    assert np.mean([f.highest > 0.7 / math.log(2.0) for f in found]) > 0.9
