"""The plan fits sets from the law to the most probable set on all samples."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.fitting import EffectModel
from identification.gap.fits import fit_jointly
from identification.gap.noise import NoiseModel
from identification.gap.selection import plan
from identification.gap.selection.extension import compare_with_subset
from identification.gap.selection.neighbours import fit_extension
from identification.gap.selection.plan import (
    _is_explained,
    _is_gap_negligible,
    _refit_law,
    _search_best_sets,
    compute_final_posterior,
    search_forward,
)
from identification.gap.selection.posterior import compute_complexity_penalty
from identification.gap.selection.search_settings import QUICK_FIT, SearchSettings
from identification.simulate import ActiveEffect
from tests.support.candidate_pools import NOISE, make_pool, make_pool_of, record

BOTH = frozenset({"gas_spring", "moving_mass"})


@dataclass
class WatchedNoiseModel(NoiseModel):
    """A noise model that records the candidates of its updates."""

    updates: list[frozenset[str]] = field(default_factory=list)

    def update(self, candidate, full_problem, evaluation):
        self.updates.append(candidate.names)
        super().update(candidate, full_problem, evaluation)


def watch_noise(pool):
    pool.noise_model = WatchedNoiseModel(pool.noise_model.estimate, pool.noise_model.stretches)
    return pool


@pytest.fixture(scope="module")
def searched():
    pool = watch_noise(make_pool("gas_spring", "moving_mass"))
    search_forward(pool)
    return pool


def test_the_search_finds_two_true_effects_within_the_budget(searched):
    assert searched.find_best().names == BOTH
    assert searched.is_at_floor(searched.find_best())
    assert not searched.budget_spent


def test_the_noise_model_is_updated_with_the_law_and_then_with_the_best_set_of_each_size(searched):
    single = min(("gas_spring", "end_stop", "moving_mass"), key=searched.get_excess)
    assert searched.noise_model.updates == [frozenset(), frozenset({single}), BOTH]


def test_the_most_probable_set_and_its_subsets_are_fitted_on_all_samples(searched):
    posterior = compute_final_posterior(searched)
    assert posterior.rank_sets()[0][0] == BOTH
    assert posterior.sets[BOTH] > 0.9
    assert {frozenset(), BOTH, *(frozenset({name}) for name in BOTH)} <= searched.full_fits


def test_a_recording_below_the_gap_ratio_is_not_searched():
    pool = watch_noise(make_pool(no_gap_ratio=1.1))
    search_forward(pool)
    assert len(pool.fitted) == 1
    assert pool.noise_model.updates == [frozenset()]
    assert compute_final_posterior(pool).rank_sets()[0][0] == frozenset()


def state_gains(pool, monkeypatch, stated):
    """Let the screening of a pool state some gains by effect, and a negligible one for all others."""
    screen = pool.screen

    def state(parent, without):
        found = [(g, stated.get(g.effect_model.name, 0.001)) for g in screen(parent, without)]
        gains = [replace(g, predicted_gain=value, achieved_gain=value) for g, value in found]
        return sorted(gains, key=lambda g: -g.predicted_gain)

    monkeypatch.setattr(pool, "screen", state)
    return pool


@pytest.mark.parametrize(("gain", "found"), [(-0.1, True), (0.001, True), (-np.inf, False)])
def test_an_effect_without_a_predicted_gain_is_fitted_where_no_other_closes_enough(monkeypatch, gain, found):
    pool = state_gains(make_pool("gas_spring"), monkeypatch, {"gas_spring": gain})
    search_forward(pool)
    assert (frozenset({"gas_spring"}) in pool.candidates) is found


def test_an_effect_without_a_predicted_gain_is_not_fitted_beside_one_that_closes_enough(monkeypatch):
    pool = state_gains(make_pool("gas_spring"), monkeypatch, {"gas_spring": 0.9, "field_saturation": -0.1})
    search_forward(pool)
    assert frozenset({"field_saturation"}) not in pool.candidates


@pytest.mark.parametrize(
    ("gain", "promising", "fitted"), [(0.41, True, True), (0.39, True, False), (0.41, False, False)]
)
def test_beside_a_set_at_the_floor_an_effect_is_fitted_if_it_is_expected_to_close_much(
    monkeypatch, gain, promising, fitted
):
    pool = make_pool("gas_spring")
    pool.fit_law()
    pool.extend("gas_spring")
    single = replace(pool.candidates[frozenset({"gas_spring"})], train_rmse=pool.floor, held_out_rmse=pool.floor)
    monkeypatch.setattr(plan, "is_extension_promising", lambda pool, names: promising)
    assert _is_explained(state_gains(pool, monkeypatch, {"coil_lag": gain}), single)
    assert (frozenset({"gas_spring", "coil_lag"}) in pool.candidates) is fitted


def test_a_set_below_the_interval_of_the_floor_disproves_it_and_the_search_goes_on():
    pool = make_pool("gas_spring", "moving_mass")
    pool.fit_law()
    pool.extend("gas_spring")
    single = pool.candidates[frozenset({"gas_spring"})]
    high = 2.0 * single.train_rmse
    pool.noise_model.estimate = replace(pool.noise_model.estimate, noise=high, deviation=0.1 * high, scales=())
    assert pool.is_at_floor(single)
    assert not _is_explained(pool, single)
    assert pool.floor == pytest.approx(NOISE, rel=0.1)
    assert "leaves less than what does not repeat" in pool.notes[0]


def make_uncertain_pool(*effects):
    """A pool whose floor has an interval that contains the error of the law."""
    pool = make_pool(*effects)
    size = 1.2 * NOISE
    pool.noise_model.estimate = replace(pool.noise_model.estimate, noise=size, deviation=0.3 * size, scales=())
    assert _is_gap_negligible(pool, pool.fit_law())
    return pool


def test_an_effect_that_noise_cannot_imitate_is_found_inside_the_interval_of_the_floor():
    pool = make_uncertain_pool(ActiveEffect(EFFECTS["moving_mass"], (1.5,)))
    search_forward(pool)
    found = pool.block_evidence[frozenset({"moving_mass"})]
    assert found.parent == frozenset()
    assert found.log_odds > 100.0
    assert compute_final_posterior(pool).rank_sets()[0][0] == frozenset({"moving_mass"})


def test_without_such_an_effect_only_the_law_remains():
    pool = make_uncertain_pool()
    search_forward(pool)
    assert len(pool.fitted) > 2
    assert set(pool.candidates) == {frozenset()}
    assert not pool.block_evidence


def test_bursts_that_the_cycles_count_as_noise_are_searched_for():
    """Their floor contains the bursts, so that the law is within the limits of a recording without a gap."""
    recording = record()
    place = np.arange(len(recording.stretches[0].force))
    bursts = np.where(place % 997 < 60, 4.0 * NOISE, 0.0) * np.sin(place)
    disturbed = replace(recording.stretches[0], force=recording.stretches[0].force + bursts)
    pool = make_pool_of(replace(recording, stretches=(disturbed,)))
    size = float(np.hypot(NOISE, bursts.std()))
    pool.noise_model.estimate = replace(
        pool.noise_model.estimate, noise=size, high_frequency=NOISE, deviation=0.1 * size, scales=()
    )
    assert _is_gap_negligible(pool, pool.fit_law())

    search_forward(pool)

    assert pool.noise_model.noise == NOISE
    assert "what does not repeat with the cycles is not noise" in pool.notes[0]
    assert len(pool.fitted) > 2


def test_each_effect_of_the_most_probable_set_has_evidence_on_held_out_samples(searched):
    compute_final_posterior(searched)
    evidence = dict(searched.held_out_evidence[BOTH])
    assert set(evidence) == {frozenset({name}) for name in BOTH}
    assert min(evidence.values()) > 1.0


def make_comparing_pool(held_out, expected, on_all, closed, in_noise=100.0):
    """A pool whose comparison of any two sets has a stated result."""
    comparison = SimpleNamespace(
        compute_held_out_evidence=lambda before, after: held_out,
        expect_held_out_evidence=lambda before, after: expected,
        compute_evidence=lambda before, after: on_all,
        compute_closed_share=lambda before, after: closed,
        compute_noise_evidence=lambda before, after: in_noise,
    )
    return SimpleNamespace(comparison=comparison, settings=SearchSettings())


@pytest.mark.parametrize(("expected", "found"), [(0.5, 12.0), (20.0, -0.5)])
def test_held_out_samples_do_not_judge_an_effect_that_hardly_acts_on_them(expected, found):
    subset, candidate = (SimpleNamespace(names=frozenset(names)) for names in (["gas_spring"], BOTH))
    assert compare_with_subset(make_comparing_pool(-0.5, expected, 12.0, 0.9), subset, candidate).log_odds == found


@pytest.mark.parametrize(("closed", "kept"), [(0.39, False), (0.41, True)])
def test_an_effect_that_closes_little_of_what_the_others_leave_repairs_their_form(closed, kept):
    subset, candidate = (SimpleNamespace(names=frozenset(names)) for names in (["gas_spring"], BOTH))
    parent, log_odds = compare_with_subset(make_comparing_pool(9.0, 9.0, 9.0, closed), subset, candidate)
    assert parent == subset.names
    assert log_odds == (9.0 if kept else -compute_complexity_penalty(subset.names))
    assert log_odds > 0.0 or not kept


@pytest.mark.parametrize("excess", [-1.0, 1.0])
def test_noise_of_the_residuals_spectrum_bounds_the_evidence_of_an_effect(excess):
    subset, candidate = (SimpleNamespace(names=frozenset(names)) for names in (["gas_spring"], BOTH))
    in_noise = compute_complexity_penalty(subset.names) + excess
    pool = make_comparing_pool(9.0, 9.0, 9.0, 0.9, in_noise)
    assert compare_with_subset(pool, subset, candidate).log_odds == pytest.approx(excess)


def test_a_law_in_a_wrong_minimum_is_fitted_again_from_the_law_of_the_best_set():
    pool = make_pool()
    right = pool.fit_law()
    start = pool.problems.regression_start.copy()
    start[pool.problems.decimated.layout.coordinates] += 1.0
    wrong = pool.evaluate(
        fit_jointly(pool.problems.decimated, (), None, replace(QUICK_FIT, iterations=0), [start])
    )
    assert wrong.held_out_rmse > 2.0 * right.held_out_rmse
    pool.candidates[frozenset()] = wrong
    pool.fit((EffectModel.from_name("coil_crosstalk"),), [np.append(right.fit.minimum.unknowns, 0.0)])
    _refit_law(pool)
    assert pool.baseline.held_out_rmse == pytest.approx(right.held_out_rmse, rel=1e-2)


def test_the_best_sets_are_searched_from_the_starts_of_the_law():
    pool = make_pool("seal_friction")
    baseline = pool.fit_law()
    gains = pool.screen(baseline, frozenset())
    friction = next(g for g in gains if g.effect_model.name == "seal_friction")
    stuck = fit_extension(pool, baseline, friction)
    before = pool.fit_count
    _search_best_sets(pool, 1)
    assert pool.fit_count > before or pool.is_at_floor(stuck)
    assert pool.find_best().names == {"seal_friction"}
    assert pool.is_at_floor(pool.find_best())
