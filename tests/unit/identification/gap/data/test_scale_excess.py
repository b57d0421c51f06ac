"""Part of a residual that exceeds the noise at its time scale."""

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.gap.data import Residual, estimate_scale_excess
from identification.noise import ScaleVariance, measure_scale_variance

RATE, COUNT = 1000.0, 60_000
SCALES = tuple(2**k for k in range(9))


def draw_slow_noise(seed):
    """Noise whose slow part has nearly all of its variance."""
    random = np.random.default_rng(seed)
    slow = lfilter([0.02], [1.0, -0.9999], random.standard_normal(2 * COUNT))[COUNT:]
    return 0.2 * random.standard_normal(COUNT) + slow


def make_residual(values, valid=None, rates=((COUNT, RATE),)):
    usable = np.ones(len(values), bool) if valid is None else valid
    zero = np.zeros(len(values))
    return Residual(values, zero, zero, np.arange(len(values)) / RATE, usable, rates)


def measure_noise(runs=10):
    """Variance of the noise by scale, from other runs of it."""
    valid = np.ones(COUNT, bool)
    measured = [
        [measure_scale_variance(draw_slow_noise(100 + k), valid, m)[0] for m in SCALES] for k in range(runs)
    ]
    means, deviations = np.mean(measured, axis=0), np.std(measured, axis=0) / np.sqrt(runs)
    return [ScaleVariance(*each) for each in zip(SCALES, means, deviations, strict=True)]


NOISE = measure_noise()


@pytest.mark.parametrize("seed", range(8))
def test_noise_does_not_exceed_itself(seed):
    assert estimate_scale_excess(make_residual(draw_slow_noise(seed)), NOISE, 0.0) is None


def test_a_fast_error_is_certain_though_slow_noise_hides_it():
    noise = draw_slow_noise(3)
    error = np.where(np.arange(COUNT) % 2000 < 40, 0.5, 0.0)
    found = estimate_scale_excess(make_residual(noise + error), NOISE, 0.0)
    assert np.var(error) < 0.01 * np.var(noise)
    assert found.lowest > 0.0
    # At the scale of the distance between two errors, the noise hides them.
    assert 0.3 * np.var(error) < found.square < 1.1 * np.var(error)


def test_an_error_of_the_size_of_the_input_noise_is_not_certain():
    error = np.where(np.arange(COUNT) % 2000 < 40, 0.5, 0.0)
    residual = make_residual(draw_slow_noise(3) + error)
    assert estimate_scale_excess(residual, NOISE, np.var(error)) is None


def test_invalid_samples_and_the_steps_between_stretches_do_not_count():
    noise = draw_slow_noise(4)
    values, valid = noise.copy(), np.ones(COUNT, bool)
    values[1000:1100], valid[1000:1100] = 50.0, False
    values[COUNT // 2 :] += 30.0
    halves = ((COUNT // 2, RATE), (COUNT // 2, RATE))
    assert estimate_scale_excess(make_residual(values, valid, halves), NOISE, 0.0) is None
    assert estimate_scale_excess(make_residual(values, valid), NOISE, 0.0) is not None


def test_without_valid_samples_or_scales_nothing_is_certain():
    noise = make_residual(draw_slow_noise(5), np.zeros(COUNT, bool))
    assert estimate_scale_excess(noise, NOISE, 0.0) is None
    assert estimate_scale_excess(make_residual(draw_slow_noise(5)), (), 0.0) is None
