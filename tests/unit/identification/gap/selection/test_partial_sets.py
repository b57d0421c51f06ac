"""Effects that close a part of a gap with an unknown cause."""

import pytest

from identification.damper.effects import EFFECTS
from identification.gap.selection import partial_sets
from identification.gap.selection.neighbours import fit_extension
from identification.gap.selection.partial_sets import compute_partial_posterior, find_partial_sets
from identification.gap.selection.posterior import Posterior
from identification.simulate import ActiveEffect
from tests.support.candidate_pools import make_pool

NONE, STOP, CROSSTALK = frozenset(), frozenset({"end_stop"}), frozenset({"coil_crosstalk"})
FRICTION = ActiveEffect(EFFECTS["seal_friction"], (2.0, 2.0, 0.015), "stribeck")
LARGE_FRICTION = ActiveEffect(EFFECTS["seal_friction"], (10.0, 10.0, 0.015), "stribeck")


@pytest.fixture(scope="module")
def pool():
    """A gap of end stop and friction, of which only the end stop and an irrelevant effect were fitted."""
    pool = make_pool("end_stop", FRICTION)
    baseline = pool.fit_law()
    gains = pool.screen(baseline, frozenset())
    for name in ("end_stop", "coil_crosstalk"):
        fit_extension(pool, baseline, next(g for g in gains if g.effect_model.name == name))
    return pool


def test_the_effect_that_helps_on_held_out_strokes_is_the_most_probable_part(pool):
    partial = compute_partial_posterior(pool)
    assert pool.candidates[STOP].held_out_rmse < 0.8 * pool.baseline.held_out_rmse
    assert partial.rank_sets()[0][0] == STOP
    assert partial.sets[STOP] > 10.0 * partial.sets[CROSSTALK]
    assert sum(partial.sets.values()) + partial.unknown == pytest.approx(1.0)


def test_an_effect_is_less_certain_the_more_of_the_gap_is_left(pool):
    remaining = pool.compute_excess(pool.candidates[STOP]) / pool.baseline_excess
    assert compute_partial_posterior(pool).sets[STOP] < 1.0 - 0.4 * remaining


def test_an_effect_may_only_resemble_an_unknown_cause(pool):
    posterior = Posterior({NONE: 0.1, STOP: 0.1}, 0.8)
    partial = find_partial_sets(pool, posterior)
    assert STOP in pool.full_fits
    alone = compute_partial_posterior(pool)
    assert partial.sets[STOP] == pytest.approx(0.1 + 0.5 * 0.8 * alone.sets[STOP])
    assert 0.1 < partial.sets[STOP] <= 0.5
    assert sum(partial.sets.values()) + partial.unknown == pytest.approx(1.0)


def test_the_subsets_of_the_most_probable_set_are_fitted(pool, monkeypatch):
    gains = pool.screen(pool.candidates[STOP], STOP)
    friction = next(g for g in gains if g.effect_model.name == "seal_friction")
    both = fit_extension(pool, pool.candidates[STOP], friction).names
    likely = Posterior({NONE: 0.05, both: 0.9}, 0.05)
    monkeypatch.setattr(partial_sets, "compute_partial_posterior", lambda pool: likely)
    find_partial_sets(pool, Posterior({NONE: 0.1}, 0.9))
    assert both in pool.full_fits
    assert {frozenset({n}) for n in both} <= set(pool.candidates)


def test_a_partial_set_grows_by_the_effect_that_helps_on_held_out_strokes():
    pool = make_pool("end_stop", LARGE_FRICTION)
    pool.candidates[NONE] = pool.fit_law()
    pool.extend("end_stop")
    partial = find_partial_sets(pool, Posterior({NONE: 0.1}, 0.9))
    assert partial.rank_sets()[0][0] == {"end_stop", "seal_friction"}
    assert pool.reaches_floor(pool.candidates[partial.rank_sets()[0][0]])


def test_a_partial_set_has_no_more_effects_than_the_settings_allow():
    pool = make_pool("end_stop", LARGE_FRICTION, max_partial_effects=1)
    pool.candidates[NONE] = pool.fit_law()
    pool.extend("end_stop")
    find_partial_sets(pool, Posterior({NONE: 0.1}, 0.9))
    assert max(map(len, pool.candidates)) == 1
