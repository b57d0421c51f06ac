"""Probabilities of sets of effects and of an unknown cause."""

import math

import pytest

from identification.gap.selection.posterior import (
    BlockEvidence,
    Posterior,
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


@pytest.mark.parametrize(("noise_excess", "is_unknown"), [(0.0, True), (0.05, True), (0.4, False)])
def test_an_excess_within_the_uncertainty_of_the_noise_floor_has_no_unknown_cause(noise_excess, is_unknown):
    sets = [SetEvidence(frozenset(), 0.15), SetEvidence(frozenset({"gas_spring"}), 0.14)]
    posterior = compute_posterior(sets, SAMPLES, noise_excess=noise_excess)
    assert (posterior.unknown > 0.5) is is_unknown
    assert (posterior.sets[frozenset()] > 0.5) is not is_unknown


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


def compute_odds(posterior, first, second):
    return posterior.sets[frozenset(first)] / posterior.sets[frozenset(second)]


PRIOR_OF_ONE = 0.5 / 16.0 * 0.1
"""Prior of one of sixteen common effects, with the factor for its parameters."""


def test_odds_follow_the_ratio_of_excesses_beyond_the_resolution():
    # Resolution: 0.004 + 10 / 1000 + 0.05 x 0.1 + 0.01 x gap.
    posterior = compute_posterior(make_sets(none=1.0, gas_spring=0.3), 1000, coloured_share=0.1)
    expected = PRIOR_OF_ONE / 0.2 * (1.029 / 0.329) ** 6
    assert compute_odds(posterior, {"gas_spring"}, ()) == pytest.approx(expected)
    single = compute_posterior(make_sets(none=1.0, gas_spring=0.3), 1)
    assert compute_odds(single, {"gas_spring"}, ()) == pytest.approx(PRIOR_OF_ONE / 0.2 * (11.014 / 10.314) ** 6)


def test_a_set_that_leaves_more_than_a_fifth_of_a_large_gap_loses_odds():
    posterior = compute_posterior(make_sets(none=2.0, gas_spring=0.5, end_stop=0.39), 1000)
    # Of the gap of 2, the empty set leaves 5 times a fifth, the first effect 1.25 times, the second less than one.
    odds = compute_odds(posterior, {"gas_spring"}, ())
    assert odds == pytest.approx(PRIOR_OF_ONE / 0.2 * (2.034 / 0.534 * 5.0 / 1.25) ** 6)
    odds = compute_odds(posterior, {"end_stop"}, {"gas_spring"})
    assert odds == pytest.approx((0.534 / 0.424 * 1.25) ** 6)


@pytest.mark.parametrize(
    ("names", "prior"),
    [
        ({"gas_spring", "end_stop"}, 0.25 / 120.0 * 0.1**2),
        ({"force_filter"}, 0.5 / 16.0 * 0.1 * 0.3),
        ({"gas_spring", "force_filter"}, 0.25 / 120.0 * 0.1**2 * 0.3),
        ({"gas_spring", "end_stop", "coil_lag", "moving_mass", "force_delay"}, 0.005 / 4368.0 * 0.1**5),
    ],
)
def test_the_prior_falls_with_the_number_of_effects_and_their_rarity(names, prior):
    sets = [SetEvidence(frozenset(), 0.2), SetEvidence(frozenset(names), 0.2, weight=0.5)]
    posterior = compute_posterior(sets, 1000)
    assert compute_odds(posterior, names, ()) == pytest.approx(0.5 * prior / 0.2)


@pytest.mark.parametrize(
    ("gap", "excess", "known", "unknown"),
    [
        # Odds of effect, none and unknown: 1, 0.3611, 0.4529. Misattribution: (0.02 + 0.4 x 0.4220) x 0.8009.
        (0.5, 0.2, 0.4679, 0.3631),
        # Odds of effect and unknown: 1, 1.5182. Misattribution: 0.02 + 0.4 x 0.2625.
        (2.0, 0.5, 0.34746, 0.65253),
    ],
)
def test_an_unknown_cause_competes_and_misattribution_counts_as_one(gap, excess, known, unknown):
    posterior = compute_posterior(make_sets(none=gap, gas_spring=excess), 1000)
    assert posterior.sets[frozenset({"gas_spring"})] == pytest.approx(known, rel=1e-3)
    assert posterior.unknown == pytest.approx(unknown, rel=1e-3)


def test_an_excess_below_the_floor_counts_as_none():
    below = compute_posterior(make_sets(none=0.5, gas_spring=-0.1), 1000)
    at_zero = compute_posterior(make_sets(none=0.5, gas_spring=0.0), 1000)
    assert below.sets[frozenset({"gas_spring"})] == pytest.approx(
        at_zero.sets[frozenset({"gas_spring"})], rel=5e-3
    )
    assert compute_posterior(make_sets(none=-0.5), 1000).sets[frozenset()] == pytest.approx(1.0, abs=1e-3)


def test_the_complexity_penalty_is_the_ratio_of_the_priors():
    assert compute_complexity_penalty(frozenset()) == pytest.approx(math.log(0.2 / PRIOR_OF_ONE))
    one = compute_complexity_penalty(frozenset({"end_stop"}))
    assert one == pytest.approx(math.log(PRIOR_OF_ONE / (0.25 / 120.0 * 0.01)))


def test_a_stage_has_the_probability_of_its_effects_and_a_share_of_the_unknown():
    sets = {frozenset(): 0.1, frozenset({"gas_spring", "end_stop"}): 0.3, frozenset({"end_stop", "coil_lag"}): 0.2}
    stages = compute_stage_probabilities(Posterior(sets, 0.4), ("coil", "damper", "mounting", "force_channel"))
    assert stages == pytest.approx({"coil": 0.3, "damper": 0.6, "mounting": 0.1, "force_channel": 0.1})
    full = compute_stage_probabilities(Posterior({frozenset({"coil_lag"}): 0.9}, 0.4), ("coil", "damper"))
    assert full == pytest.approx({"coil": 1.0, "damper": 0.2})
    located = compute_stage_probabilities(
        Posterior({frozenset({"coil_lag"}): 0.3}, 0.7), ("coil", "damper"), unlisted={"coil": 0.1, "damper": 0.9}
    )
    assert located == pytest.approx({"coil": 0.37, "damper": 0.63})


def name_with_held_out_evidence(log_odds):
    """The most probable set where a second effect closes the gap, with this evidence on held-out samples."""
    first, both = frozenset({"end_stop"}), frozenset({"end_stop", "coil_lag"})
    sets = make_sets(none=30.0, end_stop=4.0)
    evidence = (BlockEvidence(first, log_odds),)
    return compute_posterior([*sets, SetEvidence(both, 0.1, held_out_evidence=evidence)], SAMPLES).rank_sets()[0][
        0
    ]


def test_a_second_effect_is_not_named_if_it_gains_nothing_on_held_out_samples():
    assert name_with_held_out_evidence(1.0) == frozenset({"end_stop", "coil_lag"})
    assert name_with_held_out_evidence(-1.0) == frozenset({"end_stop"})


def test_a_set_that_harms_held_out_samples_is_less_probable_than_the_one_without_the_effect():
    first, both = frozenset({"end_stop"}), frozenset({"end_stop", "coil_lag"})
    evidence = (BlockEvidence(first, -2.0), BlockEvidence(frozenset(), 50.0))
    sets = [*make_sets(none=30.0, end_stop=4.0), SetEvidence(both, 0.1, held_out_evidence=evidence)]
    posterior = compute_posterior(sets, SAMPLES)
    assert posterior.sets[both] / posterior.sets[first] == pytest.approx(math.exp(-2.0))


SEVERAL = "end_stop__gas_spring__displacement_nonlinearity"


def make_curve(excess: float, block_evidence: BlockEvidence | None = None) -> SetEvidence:
    return SetEvidence(frozenset({"curve"}), excess, block_evidence=block_evidence)


def test_a_curve_outside_the_library_that_leaves_less_is_more_probable_than_several_effects():
    sets = make_sets(none=100.0, **{SEVERAL: 1.6})
    assert compute_posterior(sets, SAMPLES).rank_sets()[0][1] > 0.5
    posterior = compute_posterior(sets, SAMPLES, curve=make_curve(0.02))
    assert posterior.unknown > 0.95
    assert posterior.compute_effect_probability("end_stop") < 0.05


def test_a_curve_outside_the_library_that_leaves_more_changes_nothing():
    sets = make_sets(none=100.0, gas_spring=0.3)
    posterior = compute_posterior(sets, SAMPLES, curve=make_curve(20.0))
    assert posterior.unknown == pytest.approx(compute_posterior(sets, SAMPLES).unknown, abs=1e-3)


def test_of_two_causes_that_leave_as_much_the_one_in_the_library_is_more_probable():
    sets = make_sets(none=100.0, gas_spring=0.3)
    posterior = compute_posterior(sets, SAMPLES, curve=make_curve(0.3))
    assert posterior.compute_effect_probability("gas_spring") > 0.7
    assert posterior.unknown > compute_posterior(sets, SAMPLES).unknown


def test_block_evidence_of_a_set_does_not_hide_a_curve_that_has_more_of_it():
    first, both = frozenset({"end_stop"}), frozenset({"end_stop", "gas_spring"})
    sets = [
        *make_sets(none=70.0, end_stop=6.0),
        SetEvidence(both, 3.7, block_evidence=BlockEvidence(first, 60.0)),
    ]
    assert compute_posterior(sets, SAMPLES, curve=make_curve(0.02)).sets[both] > 0.5
    curve = make_curve(0.02, BlockEvidence(both, 40.0))
    assert compute_posterior(sets, SAMPLES, curve=curve).unknown > 0.95
    worse = make_curve(4.0, BlockEvidence(both, -40.0))
    assert compute_posterior(sets, SAMPLES, curve=worse).sets[both] > 0.5


def test_a_curve_with_the_name_of_an_effect_raises_the_odds_of_that_effect():
    several = frozenset({"end_stop", "gas_spring", "displacement_nonlinearity"})
    sets = make_sets(none=5.0, displacement_nonlinearity=2.0, **{SEVERAL: 1.2})
    assert compute_posterior(sets, SAMPLES).compute_effect_probability("displacement_nonlinearity") < 0.1
    curve = SetEvidence(
        frozenset({"displacement_nonlinearity"}), 0.02, block_evidence=BlockEvidence(several, 40.0)
    )
    posterior = compute_posterior(sets, SAMPLES, curve=curve)
    assert posterior.most_probable_set == {"displacement_nonlinearity"}
    assert posterior.compute_effect_probability("gas_spring") < 0.01
    assert posterior.unknown < 0.1
