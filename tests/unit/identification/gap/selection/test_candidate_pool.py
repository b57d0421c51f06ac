"""The candidate pool fits, screens and compares sets of effects on a short recording."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting import EffectModel
from identification.gap.selection.plan import search_forward
from identification.gap.selection.posterior import BlockEvidence
from tests.support.candidate_pools import BASELINE_FIT, NOISE, fit_baseline, make_pool

GAS = frozenset({"gas_spring"})
SPRING = (EffectModel.from_name("gas_spring"),)
POOR_FIT = replace(BASELINE_FIT, starts=1, iterations=1)


@pytest.fixture(scope="module")
def gas():
    """A pool with the law alone and with the true effect, decimated by four for the search."""
    pool = fit_baseline("gas_spring", decimation_rate=125.0)
    pool.extend("gas_spring")
    return pool


def test_the_true_effect_leaves_next_to_no_excess(gas):
    assert gas.floor == pytest.approx(NOISE, rel=0.03)
    assert gas.baseline_excess > 1.0
    # The floor of nine seconds is known to 2 %.
    assert gas.get_excess("gas_spring") < 0.1
    assert gas.find_best().names == GAS
    assert not gas.is_at_floor(gas.baseline)


def test_a_fit_returns_the_best_known_candidate_of_its_set(gas):
    pool = gas.copy()
    best = pool.candidates[GAS]
    assert pool.fit(SPRING, options=POOR_FIT) is best
    del pool.candidates[GAS]
    poor = pool.fit(SPRING, options=POOR_FIT)
    assert pool.compute_excess(poor) > gas.compute_excess(best)
    better = pool.fit(SPRING, [best.fit.minimum.unknowns])
    assert better is not poor
    assert pool.candidates[GAS] is better


def test_progress_names_the_effects_and_the_held_out_error(gas):
    reports = []
    pool = gas.copy()
    pool.progress = lambda message, error: reports.append((message, error))
    pool.fit_law()
    candidate = pool.fit(SPRING, [pool.candidates[GAS].fit.minimum.unknowns])
    assert [message for message, _ in reports] == ["law alone", "gas_spring"]
    assert reports[1][1] == pytest.approx(candidate.held_out_rmse, rel=1e-3)


@pytest.mark.parametrize("budget", [1, 4])
def test_the_search_ends_with_the_fit_that_spends_the_budget(budget):
    pool = make_pool("gas_spring", fit_budget=budget)
    search_forward(pool)
    assert pool.budget_spent
    assert pool.fit_count == len(pool.fitted) == budget


def test_a_full_fit_uses_all_samples_and_happens_once(gas):
    pool = gas.copy()
    search = pool.candidates[GAS]
    pool.fit_fully(GAS)
    full = pool.candidates[GAS]
    assert search.fit.problem.samples < 0.3 * pool.problems.full.samples
    assert full.fit.problem.samples == pool.problems.full.samples
    assert full.train_rmse <= search.train_rmse
    assert full.fit.rmse == pytest.approx(full.train_rmse, abs=2e-3 * pool.floor)
    assert pool.full_fits == {GAS}
    pool.fit_fully(GAS)
    assert pool.candidates[GAS] is full
    assert pool.fitted == []


def test_a_full_fit_first_continues_a_descent_that_was_cut_short(gas):
    pool = gas.copy()
    del pool.candidates[GAS]
    assert not pool.fit(SPRING, options=POOR_FIT).fit.converged
    pool.fit_fully(GAS)
    assert pool.fitted[0] == pool.fitted[1] == SPRING
    assert pool.get_excess("gas_spring") < 0.05


def test_a_spent_budget_leaves_the_descent_as_it_is(gas):
    pool = gas.copy(fit_budget=1)
    del pool.candidates[GAS]
    pool.fit(SPRING, options=POOR_FIT)
    pool.fit_fully(GAS)
    assert len(pool.fitted) == 1


def test_the_data_are_decimated_to_the_screening_rate_at_most():
    rate = {
        length: make_pool(long_recording=length).problems.decimated.pieces[0].excitation.rate
        for length in (10_000, 3000, 100)
    }
    assert rate == {10_000: 250.0, 3000: 250.0, 100: 125.0}


def test_evidence_holds_every_set_with_excess_weight_and_blocks(gas):
    pool = gas.copy()
    pool.block_evidence[GAS] = BlockEvidence(frozenset(), 7.0)
    evidence = {e.names: e for e in pool.collect_evidence()}
    assert set(evidence) == {frozenset(), GAS}
    assert evidence[frozenset()].excess > 20.0 * evidence[GAS].excess
    assert evidence[GAS].weight == evidence[frozenset()].weight == 1.0
    assert evidence[GAS].block_evidence == BlockEvidence(frozenset(), 7.0)
    assert evidence[frozenset()].block_evidence is None


def test_evidence_uses_a_floor_below_the_residual_of_every_set(gas):
    pool = gas.copy()
    doubled = replace(pool.noise_model.estimate, noise=2.0 * NOISE)
    pool.noise_model = replace(pool.noise_model, estimate=doubled)
    assert pool.get_excess("gas_spring") < -0.7
    assert all(e.excess > -0.1 for e in pool.collect_evidence())


def test_an_implausible_size_gets_a_small_weight():
    pool = fit_baseline("seal_friction")
    pool.extend("force_drift")
    candidate = pool.candidates[frozenset({"force_drift"})]
    bounds = candidate.fit.effects[0].get_bounds()
    unknowns = candidate.fit.minimum.unknowns.copy()
    unknowns[candidate.fit.problem.layout.effects] = bounds[0]
    fit = replace(candidate.fit, minimum=replace(candidate.fit.minimum, unknowns=unknowns))
    pool.candidates[candidate.names] = replace(candidate, fit=fit)
    weights = {e.names: e.weight for e in pool.collect_evidence()}
    assert weights[candidate.names] < 0.1 < weights[frozenset()]


def test_the_posterior_of_the_pool_names_the_true_effect(gas):
    posterior = gas.compute_posterior()
    assert posterior.rank_sets()[0][0] == GAS
    assert posterior.sets[GAS] > 0.9


def test_a_screening_ranks_the_true_effect_first_and_omits_named_ones(gas):
    gains = gas.screen(gas.baseline, frozenset({"end_stop"}))
    assert gains[0].effect_model.name == "gas_spring"
    assert gains[0].achieved_gain > 0.9
    assert "end_stop" not in {g.effect_model.name for g in gains}


def test_mains_interference_is_screened_at_the_frequency_of_the_residual():
    pool = fit_baseline("mains_hum")
    gain = pool.screen(pool.baseline, frozenset())[0]
    assert gain.effect_model.name == "mains_hum"
    start = pool.baseline.fit.problem.layout.per_log.start
    values = gain.effect_model.to_values(gain.unknowns[start:])
    assert values[-1] == pytest.approx(50.02, abs=0.02)
    assert np.hypot(values[0], values[1]) == pytest.approx(5.0, rel=0.1)
