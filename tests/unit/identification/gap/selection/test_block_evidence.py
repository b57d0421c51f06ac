"""Block evidence of one effect more."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.residual_map import Residual
from identification.gap.selection.block_evidence import bound_evidence, compute_evidence

RATE, SECONDS, FLOOR = 500.0, 40.0, 2.0
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
    assert compute_evidence(make_residual(form + small), make_residual(form)) > 5.0


def test_an_error_that_only_moves_to_other_blocks_is_no_evidence():
    before, after = np.where(TIME < 4.0, 10.0, 1.0), np.where(TIME < 4.0, 6.0, 2.0)
    assert compute_evidence(make_residual(before), make_residual(after)) < 0.0
    assert np.mean(after**2) < np.mean(before**2)


def test_an_effect_that_reaches_the_floor_brings_about_the_bound():
    error = 3.0 * AFTER_STEPS
    assert compute_evidence(make_residual(error), make_residual(0.0 * error)) == pytest.approx(
        bound_evidence(make_residual(error), FLOOR), rel=0.2
    )
    assert bound_evidence(make_residual(0.0 * error), FLOOR) < 5.0


def test_blocks_with_few_valid_samples_do_not_count():
    valid = TIME > 10.0
    outside = np.where(valid, 0.0, 100.0)
    assert compute_evidence(make_residual(outside, valid), make_residual(0.0 * outside, valid)) == pytest.approx(
        0.0
    )
