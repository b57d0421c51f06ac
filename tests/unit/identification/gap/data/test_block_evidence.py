"""Block evidence of one effect more."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.block_evidence import (
    bound_evidence,
    compute_evidence,
    count_independent_samples,
)
from identification.gap.data.residual_map import Residual

RATE, SECONDS, FLOOR, BLOCK = 500.0, 40.0, 2.0, 0.4
TIME = np.arange(round(RATE * SECONDS)) / RATE
NOISE = FLOOR * default_rng(1).standard_normal(len(TIME))
AFTER_STEPS = np.exp(-(TIME % 1.0) / 0.1)


def make_residual(error, valid=None):
    mask = np.ones(len(TIME), bool) if valid is None else valid
    return Residual(NOISE + error, 0.0 * TIME, 0.0 * TIME, TIME, mask, ((len(TIME), RATE),))


def test_a_small_effect_in_many_blocks_counts_despite_a_large_error_in_few():
    form = np.where(TIME < 4.0, 40.0, 0.0)
    small = 3.0 * AFTER_STEPS
    assert np.mean(form**2) > 100.0 * np.mean(small**2)
    assert compute_evidence(make_residual(form + small), make_residual(form), BLOCK) > 5.0


def test_an_error_that_only_moves_to_other_blocks_is_no_evidence():
    before, after = np.where(TIME < 4.0, 10.0, 1.0), np.where(TIME < 4.0, 6.0, 2.0)
    assert compute_evidence(make_residual(before), make_residual(after), BLOCK) < 0.0
    assert np.mean(after**2) < np.mean(before**2)


def test_an_effect_that_reaches_the_floor_brings_about_the_bound():
    error = 3.0 * AFTER_STEPS
    assert compute_evidence(make_residual(error), make_residual(0.0 * error), BLOCK) == pytest.approx(
        bound_evidence(make_residual(error), FLOOR, BLOCK), rel=0.2
    )
    assert bound_evidence(make_residual(0.0 * error), FLOOR, BLOCK) < 5.0


def test_blocks_with_few_valid_samples_do_not_count():
    valid = TIME > 10.0
    outside = np.where(valid, 0.0, 100.0)
    assert compute_evidence(
        make_residual(outside, valid), make_residual(0.0 * outside, valid), BLOCK
    ) == pytest.approx(0.0)


def make_blocks(*stretches, rate=10.0):
    """Residuals of stretches; a block of 0.4 s has four samples. NaN is not valid."""
    values = np.concatenate([np.array(part, float) for part in stretches])
    valid = np.isfinite(values)
    values = np.where(valid, values, 99.0)
    zero = np.zeros(len(values))
    return Residual(values, zero, zero, zero, valid, tuple((len(part), rate) for part in stretches))


NAN = float("nan")


def test_evidence_sums_the_logarithms_of_the_ratios_of_blocks():
    # Mean squares 4 and 9 in the first stretch, whose last sample is no block, and 16 in the second.
    before = make_blocks([2, -2, 2, 2, 3, 3, 3, 3, 50], [4, 4, 4, 4])
    after = make_blocks([1, 1, 1, 1, 3, 3, -3, 3, 50], [8, 8, 8, 8])
    assert compute_evidence(before, after, BLOCK) == pytest.approx(0.8 * np.log(4.0 * 1.0 / 4.0))
    assert compute_evidence(after, before, BLOCK) == pytest.approx(0.8 * np.log(1.0 / 4.0 * 4.0))
    first = make_blocks([2, -2, 2, 2])
    assert compute_evidence(first, make_blocks([1, 1, 1, 1]), BLOCK) == pytest.approx(0.8 * np.log(4.0))


def test_blocks_with_more_than_half_of_their_samples_count():
    residual = make_blocks([2, 2, 2, NAN, 4, 4, NAN, NAN])
    assert bound_evidence(residual, 1.0, BLOCK) == pytest.approx(0.8 * np.log(4.0))


def test_a_block_below_the_floor_brings_no_evidence():
    residual = make_blocks([1, 1, 1, 1, 6, 6, 6, 6])
    assert bound_evidence(residual, 3.0, BLOCK) == pytest.approx(0.8 * np.log(4.0))


def test_evidence_grows_with_the_independent_samples_of_a_block():
    before, after = make_blocks([2, -2, 2, 2]), make_blocks([1, 1, 1, 1])
    assert compute_evidence(before, after, BLOCK, 10.0) == pytest.approx(5.0 * np.log(4.0))


def test_a_block_of_a_slow_residual_has_fewer_independent_samples():
    slow, fast = np.sin(2.0 * np.pi * TIME / 0.4), np.sin(2.0 * np.pi * TIME / 0.04)
    residuals = [
        Residual(e, 0.0 * TIME, 0.0 * TIME, TIME, TIME >= 0.0, ((len(TIME), RATE),)) for e in (slow, fast)
    ]
    counts = [count_independent_samples(r, 2.0) for r in residuals]
    assert counts[1] == pytest.approx(10.0 * counts[0], rel=0.2)
    assert count_independent_samples(make_residual(0.0 * TIME), 2.0) == pytest.approx(2.0 * RATE, rel=0.1)


def test_a_block_never_has_fewer_independent_samples_than_between_confusable_effects():
    constant = Residual(TIME * 0.0 + 3.0, 0.0 * TIME, 0.0 * TIME, TIME, TIME >= 0.0, ((len(TIME), RATE),))
    assert count_independent_samples(constant, BLOCK) == 1.6
