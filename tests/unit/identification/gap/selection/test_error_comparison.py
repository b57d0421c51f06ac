"""Filter behind which two errors are compared."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data.residual_map import Residual
from identification.gap.noise import NoiseModel
from identification.gap.selection.error_comparison import ErrorComparison
from identification.noise import NoiseFloorEstimate, ScaleVariance, list_scales, measure_scale_variance

RATE, COUNT, BLOCK = 1000.0, 40_000, 0.2
TIME = np.arange(COUNT) / RATE
EVERYWHERE = np.ones(COUNT, bool)


def make_candidate(values):
    residual = Residual(values, 0.0 * TIME, 0.0 * TIME, TIME, EVERYWHERE, ((COUNT, RATE),))
    return SimpleNamespace(residual=residual)


def make_comparison(noise, white, held_out=EVERYWHERE, input_noise=None):
    """Comparison in a recording whose noise (N,) has a white part of a known standard deviation."""
    scales = []
    for samples in list_scales(COUNT):
        variance, count = measure_scale_variance(noise, EVERYWHERE, samples)
        scale = ScaleVariance(samples, variance, 0.0)
        scales.append(scale._replace(deviation=scale.compute_chance(count)))
    floor = float(noise.std())
    estimate = NoiseFloorEstimate(floor, floor, white, "known", 0.01 * floor, tuple(scales))
    return ErrorComparison(NoiseModel(estimate, [], input_noise=input_noise), held_out, BLOCK)


@pytest.fixture(scope="module")
def slow_noise():
    """Noise of which nine tenths of the variance have a correlation time of 50 ms."""
    random = default_rng(3)
    decay = np.exp(-1.0 / (0.05 * RATE))
    slow = lfilter([1.0], [1.0, -decay], random.standard_normal(COUNT)) * np.sqrt(1.0 - decay**2)
    return np.sqrt(0.9) * slow + np.sqrt(0.1) * random.standard_normal(COUNT)


def test_a_fast_error_is_compared_behind_the_filter(slow_noise):
    fast = 0.5 * np.sin(2.0 * np.pi * 150.0 * TIME)
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    chosen = comparison.choose_filter(make_candidate(slow_noise + fast))
    assert len(chosen.taps) > 1
    assert chosen.deviation < 0.6


def test_an_error_as_slow_as_the_noise_is_compared_as_recorded(slow_noise):
    slow = 3.0 * np.sin(2.0 * np.pi * TIME)
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    chosen = comparison.choose_filter(make_candidate(slow_noise + slow))
    np.testing.assert_array_equal(chosen.taps, [1.0])
    assert chosen.deviation == comparison.noise_model.noise


def test_a_removed_error_is_evidence_behind_either_filter(slow_noise):
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    for error in (0.5 * np.sin(2.0 * np.pi * 150.0 * TIME), 3.0 * np.sin(2.0 * np.pi * TIME)):
        before, after = make_candidate(slow_noise + error), make_candidate(slow_noise)
        found = comparison.compute_evidence(before, after)
        assert found > 20.0
        assert found == pytest.approx(comparison.bound_evidence(before), rel=0.2)
        assert comparison.compute_evidence(after, before) < 0.0


def test_held_out_evidence_ignores_the_other_samples(slow_noise):
    held_out = TIME > 30.0
    comparison = make_comparison(slow_noise, np.sqrt(0.1), held_out)
    before = make_candidate(slow_noise + np.where(held_out, 0.0, 3.0))
    assert comparison.compute_evidence(before, make_candidate(slow_noise)) > 10.0
    assert comparison.compute_held_out_evidence(before, make_candidate(slow_noise)) == pytest.approx(0.0, abs=1.0)


def test_propagated_noise_of_the_displacement_is_part_of_the_floor(slow_noise):
    before = make_candidate(slow_noise + 3.0 * np.sin(2.0 * np.pi * TIME))
    bounds = [make_comparison(slow_noise, np.sqrt(0.1), input_noise=n).bound_evidence(before) for n in (0.0, 2.0)]
    assert bounds[1] < 0.5 * bounds[0]
