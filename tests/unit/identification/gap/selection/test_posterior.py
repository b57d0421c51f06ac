"""Probabilities of sets of effects and of an unknown cause."""

import pytest

from identification.gap.selection.posterior import (
    BlockEvidence,
    SetEvidence,
    compute_complexity_penalty,
    compute_posterior,
    compute_stage_probabilities,
)

SAMPLES = 70_000


def make_sets(**excess):
    """Evidence of sets; ``a__b`` is the set of a and b, ``none`` the empty one."""
    return [
        SetEvidence(frozenset(filter(None, key.split("__"))) if key != "none" else frozenset(), value)
        for key, value in excess.items()
    ]


def test_probabilities_add_to_one():
    posterior = compute_posterior(make_sets(none=8.0, gas_spring=0.3, end_stop=1.0), SAMPLES)
    assert sum(posterior.sets.values()) + posterior.unknown == pytest.approx(1.0)


def test_an_effect_that_closes_nearly_all_of_a_large_gap_is_nearly_certain():
    posterior = compute_posterior(make_sets(none=8.0, gas_spring=0.05, end_stop=1.0, seal_friction=5.0), SAMPLES)
    assert posterior.rank_sets()[0][0] == frozenset({"gas_spring"})
    assert posterior.compute_effect_probability("gas_spring") > 0.9


def test_a_recording_at_the_floor_has_no_effect():
    posterior = compute_posterior(
        make_sets(none=0.006, gas_spring=0.005, end_stop=0.005, moving_mass=0.006), SAMPLES
    )
    assert posterior.rank_sets()[0][0] == frozenset()
    assert posterior.unknown < 0.1


def test_a_second_effect_that_only_reduces_the_form_error_is_not_named():
    posterior = compute_posterior(make_sets(none=30.0, end_stop=0.7, end_stop__gas_spring=0.4), SAMPLES)
    assert posterior.rank_sets()[0][0] == frozenset({"end_stop"})
    assert posterior.compute_effect_probability("gas_spring") < 0.5


def test_a_true_second_effect_is_named():
    posterior = compute_posterior(make_sets(none=30.0, end_stop=4.0, end_stop__gas_spring=0.1), SAMPLES)
    assert posterior.rank_sets()[0][0] == frozenset({"end_stop", "gas_spring"})
    assert posterior.compute_effect_probability("gas_spring") > 0.9


def test_two_sets_of_equal_excess_are_equally_probable():
    posterior = compute_posterior(make_sets(none=2.0, force_delay=0.010, moving_mass=0.010), SAMPLES)
    assert posterior.compute_effect_probability("force_delay") == pytest.approx(
        posterior.compute_effect_probability("moving_mass")
    )
    assert posterior.compute_effect_probability("force_delay") > 0.3


def test_a_small_gain_on_slow_noise_is_not_a_second_effect():
    sets = make_sets(none=0.3, mains_hum=0.012, force_drift__mains_hum=0.0)
    assert compute_posterior(sets, SAMPLES).rank_sets()[0][0] == frozenset({"force_drift", "mains_hum"})
    assert compute_posterior(sets, SAMPLES, coloured_share=0.3).rank_sets()[0][0] == frozenset({"mains_hum"})


@pytest.mark.parametrize(("gap", "complete"), [(4.5, True), (0.45, False)])
def test_a_set_that_leaves_half_of_a_large_gap_is_incomplete(gap, complete):
    three = make_sets(end_stop=0.5 * gap, coil_lag__end_stop__force_delay=0.085 * gap, none=gap)
    assert (len(compute_posterior(three, SAMPLES).rank_sets()[0][0]) == 3) == complete


def test_a_gap_that_no_effect_closes_has_an_unknown_cause():
    posterior = compute_posterior(make_sets(none=8.0, gas_spring=5.0, end_stop=6.0), SAMPLES)
    assert posterior.unknown > 0.8


def test_the_most_probable_stage_is_that_of_the_effect():
    posterior = compute_posterior(make_sets(none=8.0, gas_spring=0.05, force_delay=2.0), SAMPLES)
    stages = compute_stage_probabilities(
        posterior, ("coil", "damper", "mounting", "force_channel", "displacement_channel")
    )
    assert max(stages, key=stages.get) == "damper"
    assert all(0.0 <= share <= 1.0 for share in stages.values())


def name_with_block_evidence(log_odds):
    """The most probable set with this block evidence of a second effect."""
    first, both = frozenset({"end_stop"}), frozenset({"end_stop", "coil_lag"})
    sets = make_sets(none=30.0, end_stop=0.7)
    return compute_posterior(
        [*sets, SetEvidence(both, 0.6, block_evidence=BlockEvidence(first, log_odds))], SAMPLES
    ).rank_sets()[0][0]


def test_block_evidence_beyond_the_penalty_names_a_second_effect():
    penalty = compute_complexity_penalty(frozenset({"end_stop"}))
    assert name_with_block_evidence(penalty + 1.0) == frozenset({"end_stop", "coil_lag"})
    assert name_with_block_evidence(penalty - 1.0) == frozenset({"end_stop"})
    assert compute_complexity_penalty(frozenset({"end_stop", "coil_lag"})) > penalty > 0.0
