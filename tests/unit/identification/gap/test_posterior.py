import pytest

from identification.gap.posterior import Candidate, Shown, odds, price, stage_odds

SAMPLES = 70_000


def candidates(**left):
    return [
        Candidate(frozenset(filter(None, key.split("__"))) if key != "none" else frozenset(), value)
        for key, value in left.items()
    ]


def test_probabilities_add_to_one():
    found = odds(candidates(none=8.0, gas_spring=0.3, end_stop=1.0), SAMPLES)
    assert sum(found.sets.values()) + found.unknown == pytest.approx(1.0)


def test_an_effect_that_takes_nearly_all_of_a_large_gap_is_nearly_certain():
    found = odds(candidates(none=8.0, gas_spring=0.05, end_stop=1.0, seal_friction=5.0), SAMPLES)
    assert found.ranked()[0][0] == frozenset({"gas_spring"})
    assert found.of_effect("gas_spring") > 0.9


def test_a_recording_at_the_floor_has_no_effect():
    found = odds(candidates(none=0.006, gas_spring=0.005, end_stop=0.005, moving_mass=0.006), SAMPLES)
    assert found.ranked()[0][0] == frozenset()
    assert found.unknown < 0.1


def test_a_second_effect_that_only_mends_the_first_ones_form_is_not_named():
    found = odds(candidates(none=30.0, end_stop=0.7, end_stop__gas_spring=0.4), SAMPLES)
    assert found.ranked()[0][0] == frozenset({"end_stop"})
    assert found.of_effect("gas_spring") < 0.5


def test_a_real_second_effect_is_named():
    found = odds(candidates(none=30.0, end_stop=4.0, end_stop__gas_spring=0.1), SAMPLES)
    assert found.ranked()[0][0] == frozenset({"end_stop", "gas_spring"})
    assert found.of_effect("gas_spring") > 0.9


def test_two_that_fit_alike_share_the_odds():
    found = odds(candidates(none=2.0, force_delay=0.010, moving_mass=0.010), SAMPLES)
    assert found.of_effect("force_delay") == pytest.approx(found.of_effect("moving_mass"))
    assert found.of_effect("force_delay") > 0.3


def test_a_little_more_of_slow_noise_is_no_second_effect():
    found = candidates(none=0.3, mains_hum=0.012, force_drift__mains_hum=0.0)
    assert odds(found, SAMPLES).ranked()[0][0] == frozenset({"force_drift", "mains_hum"})
    assert odds(found, SAMPLES, colour=0.3).ranked()[0][0] == frozenset({"mains_hum"})


@pytest.mark.parametrize(("whole", "more"), [(4.5, True), (0.45, False)])
def test_of_a_clear_gap_what_leaves_the_half_is_not_the_whole_truth(whole, more):
    three = candidates(end_stop=0.5 * whole, coil_lag__end_stop__force_delay=0.085 * whole, none=whole)
    assert (len(odds(three, SAMPLES).ranked()[0][0]) == 3) == more


def test_what_no_effect_explains_is_unknown():
    found = odds(candidates(none=8.0, gas_spring=5.0, end_stop=6.0), SAMPLES)
    assert found.unknown > 0.8


def test_stages_follow_the_effects():
    found = odds(candidates(none=8.0, gas_spring=0.05, force_delay=2.0), SAMPLES)
    stages = stage_odds(found, ("coil", "damper", "mounting", "force_channel", "displacement_channel"))
    assert max(stages, key=stages.get) == "damper"
    assert all(0.0 <= share <= 1.0 for share in stages.values())


def with_places(log_odds):
    first, both = frozenset({"end_stop"}), frozenset({"end_stop", "coil_lag"})
    known = candidates(none=30.0, end_stop=0.7)
    return odds([*known, Candidate(both, 0.6, shown=Shown(first, log_odds))], SAMPLES).ranked()[0][0]


def test_a_second_effect_that_many_places_show_is_named_though_the_sum_hardly_changes():
    paid = price(frozenset({"end_stop"}))
    assert with_places(paid + 1.0) == frozenset({"end_stop", "coil_lag"})
    assert with_places(paid - 1.0) == frozenset({"end_stop"})
    assert price(frozenset({"end_stop", "coil_lag"})) > paid > 0.0
