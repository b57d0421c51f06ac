"""Fits with one effect more or less start where the known set ended."""

import numpy as np
import pytest

from identification.gap.selection.neighbours import find_subset, fit_extension, fit_without_effect
from tests.support.candidate_pools import fit_baseline

BOTH = frozenset({"gas_spring", "moving_mass"})


@pytest.fixture(scope="module")
def pool():
    pool = fit_baseline("gas_spring", "moving_mass")
    pool.extend("gas_spring", "moving_mass")
    return pool


def test_an_extension_starts_at_its_screening_and_at_the_regression(pool):
    pool = pool.copy()
    gain = pool.screen(pool.baseline, frozenset())[0]
    fit_extension(pool, pool.baseline, gain)
    at_screening, at_regression = pool.starts[0]
    assert at_screening is gain.unknowns
    first = pool.problems.decimated.layout.effects.start
    assert np.array_equal(at_regression[:first], pool.problems.regression_start[:first])
    assert np.array_equal(at_regression[first:], gain.unknowns[first:])


def test_an_extension_starts_at_further_values_too(pool):
    pool = pool.copy()
    gain = next(g for g in pool.screen(pool.baseline, frozenset()) if g.effect_model.name == "moving_mass")
    fit_extension(pool, pool.baseline, gain, [(1.0,), (3.0,)])
    column = pool.baseline.fit.problem.layout.per_log.start
    assert [gain.effect_model.to_values(s[column:])[0] for s in pool.starts[0][2:]] == pytest.approx([1.0, 3.0])


def test_a_subset_starts_at_the_whole_set_without_one_effect(pool):
    pool = pool.copy()
    whole = pool.candidates[BOTH]
    removed = whole.fit.effects[0]
    subset = fit_without_effect(pool, whole, removed)
    assert subset.names == BOTH - {removed.name}
    (start,) = pool.starts[0]
    assert len(start) == len(whole.fit.minimum.unknowns) - len(removed.quantities)
    assert set(start) <= set(whole.fit.minimum.unknowns)


def test_a_known_subset_is_not_fitted_again(pool):
    pool = pool.copy()
    whole = pool.candidates[BOTH]
    first, second = whole.fit.effects
    assert find_subset(pool, whole, second) is pool.candidates[frozenset({first.name})]
    assert pool.fitted == []
    assert find_subset(pool, whole, first).names == {second.name}
    assert pool.fitted == [(second,)]
