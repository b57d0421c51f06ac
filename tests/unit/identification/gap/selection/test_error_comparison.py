"""Filter behind which two errors are compared."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import Residual
from identification.gap.noise import NoiseModel
from identification.gap.selection.error_comparison import ErrorComparison
from identification.noise import NoiseFloorEstimate, ScaleVariance, list_scales, measure_scale_variance

RATE, COUNT, BLOCK = 1000.0, 40_000, 0.2
TIME = np.arange(COUNT) / RATE
EVERYWHERE = np.ones(COUNT, bool)
CONDITION = (TIME // 10.0).astype(int)
CYCLES = Cycles(TIME.astype(int), TIME % 1.0, np.arange(40) // 10, 4 * (StrokeCondition(1.0, 0.01, 1.0),))


def make_candidate(values, names=frozenset()):
    residual = Residual(values, 0.0 * TIME, 0.0 * TIME, TIME, EVERYWHERE, ((COUNT, RATE),))
    return SimpleNamespace(residual=residual, names=names)


def make_comparison(noise, white, held_out=EVERYWHERE, input_noise=None):
    """Comparison in a recording whose noise (N,) has a white part of a known standard deviation."""
    scales = []
    for samples in list_scales(COUNT):
        variance, count = measure_scale_variance(noise, EVERYWHERE, samples)
        scale = ScaleVariance(samples, variance, 0.0)
        scales.append(scale._replace(deviation=scale.compute_chance(count)))
    floor = float(noise.std())
    estimate = NoiseFloorEstimate(floor, floor, white, "known", 0.01 * floor, tuple(scales))
    return ErrorComparison(NoiseModel(estimate, [], input_noise=input_noise), held_out, BLOCK, CYCLES)


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


@pytest.mark.parametrize(("size", "certain"), [(0.3, True), (0.1, False)])
def test_an_effect_is_certain_only_if_it_is_a_gap(slow_noise, size, certain):
    """At its frequency the noise is so small that both sizes are far above it."""
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    law = make_candidate(slow_noise + size * np.sqrt(2.0) * np.sin(2.0 * np.pi * 150.0 * TIME))
    found = make_candidate(slow_noise, frozenset({"coil_lag"}))
    assert comparison.compute_noise_evidence(law, found) > 100.0
    assert comparison.exceeds_noise(law, found) is certain


@pytest.mark.parametrize(("evidence", "certain"), [(20.0, True), (7.0, False)])
def test_noise_can_imitate_an_effect_with_less_evidence_than_the_prior_odds_and_a_hundred(
    slow_noise, monkeypatch, evidence, certain
):
    """The prior odds of one effect are exp(4.2)."""
    monkeypatch.setattr(ErrorComparison, "compute_noise_evidence", lambda self, before, after: evidence)
    law, found = make_candidate(2.0 * slow_noise), make_candidate(slow_noise, frozenset({"coil_lag"}))
    assert make_comparison(slow_noise, np.sqrt(0.1)).exceeds_noise(law, found) is certain


def test_held_out_evidence_ignores_the_other_samples(slow_noise):
    held_out = TIME > 30.0
    comparison = make_comparison(slow_noise, np.sqrt(0.1), held_out)
    before = make_candidate(slow_noise + np.where(held_out, 0.0, 3.0))
    assert comparison.compute_evidence(before, make_candidate(slow_noise)) > 10.0
    assert comparison.compute_held_out_evidence(before, make_candidate(slow_noise)) == pytest.approx(0.0, abs=1.0)


def test_the_expected_evidence_is_that_of_a_right_candidate_and_small_where_nothing_acts(slow_noise):
    held_out, error = TIME > 30.0, 3.0 * np.sin(2.0 * np.pi * TIME)
    comparison = make_comparison(slow_noise, np.sqrt(0.1), held_out)
    right = make_candidate(slow_noise)
    elsewhere, everywhere = (make_candidate(slow_noise + part * error) for part in (~held_out, 1.0))
    expected = comparison.expect_held_out_evidence(everywhere, right)
    assert expected > 10.0
    assert expected == pytest.approx(comparison.compute_held_out_evidence(everywhere, right), rel=0.2)
    assert comparison.expect_held_out_evidence(elsewhere, right) == pytest.approx(0.0, abs=1e-9)


def test_propagated_noise_of_the_displacement_is_part_of_the_floor(slow_noise):
    before = make_candidate(slow_noise + 3.0 * np.sin(2.0 * np.pi * TIME))
    bounds = [make_comparison(slow_noise, np.sqrt(0.1), input_noise=n).bound_evidence(before) for n in (0.0, 2.0)]
    assert bounds[1] < 0.5 * bounds[0]


def test_the_closed_share_is_the_part_of_the_error_that_disappears(slow_noise):
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    error = (1.0 + CONDITION) * np.sin(2.0 * np.pi * TIME)
    candidates = {part: make_candidate(slow_noise + part * error) for part in (1.0, 0.9, 0.5)}
    half, little = (comparison.compute_closed_share(candidates[1.0], candidates[part]) for part in (0.5, 0.9))
    assert half == pytest.approx(0.75, abs=0.05)
    assert little == pytest.approx(0.19, abs=0.05)


def test_the_closed_share_counts_each_condition_once(slow_noise):
    """One condition with most of the error does not mask the others."""
    comparison = make_comparison(slow_noise, np.sqrt(0.1))
    sine = np.sin(2.0 * np.pi * TIME)
    remaining = np.where(CONDITION == 0, 20.0, 2.0) * sine
    without_others = np.where(CONDITION == 0, 20.0, 1.0) * sine
    before, after = make_candidate(slow_noise + remaining), make_candidate(slow_noise + without_others)
    assert comparison.compute_closed_share(before, after) == pytest.approx(1.0 - 0.25**0.75, abs=0.05)


def test_a_residual_below_the_floor_lowers_the_noise_of_the_closed_share(slow_noise):
    comparison = make_comparison(2.0 * slow_noise, 2.0 * np.sqrt(0.1))
    before, after = make_candidate(slow_noise + np.sin(2.0 * np.pi * TIME)), make_candidate(slow_noise)
    assert comparison.compute_closed_share(before, after) > 0.8
