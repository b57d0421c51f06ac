"""One effect more is added to the most probable set if it closes enough, and its block evidence pays for it."""

from dataclasses import replace

import pytest

from identification.damper.effects import EFFECTS
from identification.gap.data import compute_evidence
from identification.gap.selection.extension import try_extension
from identification.gap.selection.posterior import compute_complexity_penalty
from identification.simulate import ActiveEffect
from tests.support.candidate_pools import fit_baseline

GAS, STOP = frozenset({"gas_spring"}), frozenset({"gas_spring", "end_stop"})
BOTH = frozenset({"gas_spring", "seal_friction"})


@pytest.fixture(scope="module")
def pool():
    """A large gas spring beside which a small friction was not found, fitted on all samples."""
    large = ActiveEffect(EFFECTS["gas_spring"], (300.0, 0.05))
    small = ActiveEffect(EFFECTS["seal_friction"], (9.0, 4.0, 0.015))
    pool = fit_baseline(large, small)
    pool.extend("gas_spring", "end_stop")
    pool.fit_fully(GAS)
    return pool.copy()


def test_an_effect_with_block_evidence_is_accepted_and_its_subsets_are_fitted(pool):
    pool = pool.copy()
    assert try_extension(pool, GAS)
    assert pool.block_evidence[BOTH].log_odds > compute_complexity_penalty(GAS)
    assert pool.block_evidence[BOTH].parent == GAS
    assert BOTH in pool.full_fits
    assert frozenset({"seal_friction"}) in pool.candidates


def test_an_effect_that_closes_little_has_no_evidence(pool):
    """A form error returns in every block, so that evidence over blocks would count it many times."""
    found, counted = pool.copy(), pool.copy(min_closed_share=-1.0)
    assert try_extension(found, GAS)
    assert set(found.block_evidence) == {BOTH}
    assert try_extension(counted, GAS)
    others = [e.log_odds for names, e in counted.block_evidence.items() if names != BOTH]
    assert max(others) < 1.0


def test_confusable_effects_are_not_fitted_where_a_small_gain_is_expected(pool):
    pool = pool.copy(extension_effects=100)
    try_extension(pool, GAS)
    fitted = {model.name for effects in pool.fitted for model in effects}
    assert "seal_friction" in fitted
    assert not fitted & {"end_stop", "side_load_friction", "displacement_nonlinearity"}


def test_a_confusable_effect_is_fitted_where_a_large_gain_is_expected(pool, monkeypatch):
    pool = pool.copy()
    gains = [g for g in pool.screen(pool.candidates[GAS], GAS) if g.effect_model.name == "side_load_friction"]
    gain = replace(gains[0], predicted_gain=0.41, achieved_gain=0.41)
    monkeypatch.setattr(pool, "screen", lambda parent, without: [gain])
    try_extension(pool, GAS)
    assert [model.name for model in pool.fitted[0]] == ["gas_spring", "side_load_friction"]


@pytest.mark.parametrize(("share", "fitted"), [(1e9, True), (-1e9, False)])
def test_a_single_effect_is_fitted_from_the_side_of_a_confusable_one_that_closes_a_part(pool, share, fitted):
    pool = pool.copy(extension_effects=0, helpful_mounting_share=share)
    pool.extend("end_stop")
    pool.fitted.clear()
    try_extension(pool, GAS)
    pairs = [[model.name for model in effects] for effects in pool.fitted]
    assert (["end_stop", "gas_spring"] in pairs) is fitted


def test_a_confusable_effect_that_the_search_has_fitted_pays_a_penalty(pool):
    pool = pool.copy(extension_effects=0, min_closed_share=-1.0)
    assert not try_extension(pool, GAS)
    evidence = compute_evidence(
        pool.candidates[GAS].residual, pool.candidates[STOP].residual, pool.problems.block_length
    )
    assert pool.block_evidence[STOP].log_odds == pytest.approx(evidence - 8.0)
    assert set(pool.block_evidence) == {STOP}


def test_the_best_extension_of_the_search_is_considered_without_a_shortlist(pool):
    pool = pool.copy()
    pool.extend("gas_spring", "seal_friction")
    found = pool.copy(extension_effects=0)
    assert try_extension(found, GAS)
    assert set(found.block_evidence) == {BOTH}


@pytest.mark.parametrize(
    ("names", "settings"),
    [(frozenset(), {}), (GAS, {"max_effects": 1}), (GAS, {"max_remaining_share": 0.01})],
    ids=["no effect", "largest set", "most of the gap remains"],
)
def test_no_extension_is_tried_where_none_can_be_named(pool, names, settings):
    pool = pool.copy(**settings)
    assert not try_extension(pool, names)
    assert pool.fitted == []
    assert pool.block_evidence == {}
