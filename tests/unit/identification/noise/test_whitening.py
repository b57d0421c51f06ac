"""The whitening filter makes noise of known time scales white, and leaves white noise alone."""

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.noise import ScaleVariance, design_whitening_filter, list_scales, measure_scale_variance

COUNT = 40_000


def draw_noise(slow, seed):
    """Noise of variance 1; a part of it has a correlation time of 20 samples."""
    random = np.random.default_rng(seed)
    decay = np.exp(-1.0 / 20.0)
    coloured = lfilter([np.sqrt(1.0 - decay**2)], [1.0, -decay], random.standard_normal(COUNT))
    return np.sqrt(1.0 - slow) * random.standard_normal(COUNT) + np.sqrt(slow) * coloured


def measure_scales(values):
    found = []
    for samples in list_scales(COUNT // 16):
        variance, differences = measure_scale_variance(values, np.ones(COUNT, bool), samples)
        scale = ScaleVariance(samples, variance, 0.0)
        found.append(scale._replace(deviation=scale.compute_chance(differences)))
    return found


@pytest.mark.parametrize("slow", [0.5, 0.9])
def test_slow_noise_becomes_white_with_the_stated_deviation(slow):
    whitening = design_whitening_filter(measure_scales(draw_noise(slow, 1)), np.sqrt(1.0 - slow))
    white = whitening.apply(draw_noise(slow, 2))[len(whitening.taps) :]

    power = np.abs(np.fft.rfft(white)) ** 2 / len(white)
    bands = [float(part.mean()) for part in np.array_split(power[1:], 8)]
    assert white.std() == pytest.approx(whitening.deviation, rel=0.02)
    assert bands == pytest.approx([whitening.deviation**2] * 8, rel=0.2)


def make_equal_scales(last_variance, last_deviation):
    """Scales of 1/f noise of variance 1 at each; the slowest one is given."""
    samples = 2 ** np.arange(10)
    scales = [ScaleVariance(int(m), 1.0, np.sqrt(4.0 * m / 20_000)) for m in samples]
    return [*scales, ScaleVariance(1024, last_variance, last_deviation)]


def compute_slow_gain(scales):
    """Gain of the filter at frequency zero."""
    return float(design_whitening_filter(scales, np.sqrt(2.0)).taps.sum())


def test_an_uncertain_slowest_scale_does_not_count_as_white():
    certain = compute_slow_gain(make_equal_scales(1.0, 0.1))

    assert certain < 0.2
    assert compute_slow_gain(make_equal_scales(1.0, 0.8)) < 0.2


def test_a_scale_that_is_small_by_chance_changes_the_filter_by_little():
    assert compute_slow_gain(make_equal_scales(0.03, 0.01)) < 0.4


def test_the_first_tap_is_one_and_nothing_precedes_the_signal():
    whitening = design_whitening_filter(measure_scales(draw_noise(0.9, 1)), np.sqrt(0.1))
    step = np.zeros(300)
    step[100] = 1.0

    assert whitening.taps[0] == pytest.approx(1.0)
    assert whitening.apply(step)[:101] == pytest.approx(step[:101], abs=1e-12)


@pytest.mark.parametrize("scales", [(), "white"])
def test_white_noise_and_noise_of_unknown_colour_are_left_alone(scales):
    found = measure_scales(draw_noise(0.0, 1)) if scales else ()
    whitening = design_whitening_filter(found, 1.0)

    assert len(whitening.taps) == 1
    assert whitening.deviation == 1.0
