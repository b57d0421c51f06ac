"""The plan fits sets from the law to the most probable set on all samples."""

from dataclasses import dataclass, field

import pytest

from identification.gap.noise import NoiseModel
from identification.gap.selection.plan import compute_final_posterior, search_forward
from tests.support.candidate_pools import make_pool

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
