import math

import pytest
from trial_examples import ANSWERED, said, truth

from sim_rig.trial.answer import Trial
from sim_rig.trial.folder import Outcome
from sim_rig.trial.score import NOTHING, UNKNOWN, bins, scores, share
from sim_rig.trial.table import table
from sim_rig.trial.unseal import LEAST, judged, true_shrinkage


def judge(case, diagnosis, prediction=None, name="case_000"):
    return judged(case, name, ANSWERED, diagnosis, prediction)


def test_the_very_set_named_first_is_right_with_its_probability():
    found = judge(truth("gas_spring", "end_stop"), said("explained", "end_stop", "gas_spring", probability=0.7))
    assert (found.right, found.among, found.probability_of_truth) == (True, True, 0.7)


@pytest.mark.parametrize("names", [("gas_spring",), ("gas_spring", "end_stop", "moving_mass"), ("moving_mass",)])
def test_too_few_too_many_or_others_are_not_right(names):
    found = judge(truth("gas_spring", "end_stop"), said("explained", *names))
    assert (found.right, found.among, found.probability_of_truth) == (False, False, LEAST)


def test_a_set_among_the_alternatives_counts_as_among_with_its_own_probability():
    others = [{"effects": ["moving_mass"], "probability": 0.05}, {"effects": ["gas_spring"], "probability": 0.2}]
    found = judge(truth("gas_spring"), said("explained", "end_stop", alternatives=others))
    assert (found.right, found.among, found.probability_of_truth) == (False, True, 0.2)


def test_nothing_is_right_where_nothing_is():
    assert judge(truth(), said("no_gap", probability=0.95)).probability_of_truth == 0.95
    assert judge(truth(), said("no_gap")).right
    assert not judge(truth(), said("explained", "gas_spring")).right
    assert not judge(truth(), said("unexplained")).right


def test_an_unknown_effect_wants_a_gap_without_a_name():
    unknown = truth("hanging_valve", kind="unknown")
    assert judge(unknown, said("unexplained", unknown_probability=0.6)).right
    assert judge(unknown, said("unexplained", unknown_probability=0.6)).probability_of_truth == 0.6
    assert not judge(unknown, said("partly_explained", "seal_friction")).right
    assert not judge(unknown, said("no_gap")).right


def test_a_known_effect_that_stays_unexplained_is_not_right():
    found = judge(truth("gas_spring"), said("unexplained"))
    assert (found.right, found.probability_of_truth) == (False, LEAST)


def test_a_case_without_a_diagnosis_counts_against_it():
    failed = judged(truth("gas_spring"), "case_000", Outcome(seconds=3.0, failure="it fell over"), None)
    found = scores([failed, judge(truth("gas_spring"), said("explained", "gas_spring"))])
    assert found.failures == 1
    assert (found.named_first["all"].count, found.named_first["all"].of) == (1, 2)
    assert found.seconds_most == 12.0


def test_groups_false_alarms_and_unknown_ones():
    cases = [
        judge(truth("gas_spring"), said("explained", "gas_spring")),
        judge(truth("gas_spring", magnitude="small", method="poor"), said("explained", "end_stop")),
        judge(truth("gas_spring", "end_stop"), said("explained", "gas_spring", "end_stop")),
        judge(truth(magnitude=None), said("explained", "end_stop")),
        judge(truth(magnitude=None), said("no_gap")),
        judge(truth("hanging_valve", kind="unknown"), said("unexplained")),
        judge(truth("hanging_valve", kind="unknown"), said("explained", "end_stop")),
    ]
    found = scores(cases)
    first = {name: (group.count, group.of) for name, group in found.named_first.items()}
    assert first["all"] == (2, 3)
    assert first["large"] == (2, 2)
    assert first["small poor"] == (0, 1)
    assert first["pair"] == (1, 1)
    assert first["triple"] == (0, 0)
    assert (found.false_alarms.count, found.false_alarms.of) == (1, 2)
    assert (found.no_gap_on_nothing.count, found.unknown_left_unknown.count) == (1, 1)
    assert found.confusion[f"hanging_valve {UNKNOWN}"] == {UNKNOWN: 1, "end_stop": 1}
    assert found.confusion[NOTHING] == {NOTHING: 1, "end_stop": 1}
    assert found.confusion["gas_spring"] == {"gas_spring": 1, "end_stop": 1}
    assert (found.effects["gas_spring"].cases, found.effects["gas_spring"].found) == (3, 2)
    assert found.effects["end_stop"].falsely == 3


def test_the_log_score_is_the_mean_over_all_answers():
    cases = [
        judge(truth("gas_spring"), said("explained", "gas_spring", probability=0.5)),
        judge(truth("gas_spring"), said("explained", "end_stop", probability=0.9)),
    ]
    assert scores(cases).log_score == pytest.approx((math.log(0.5) + math.log(LEAST)) / 2)


def test_a_calibration_curve_puts_claims_beside_what_came_true():
    found = bins([(0.9, True), (0.85, False), (0.1, False), (1.0, True)])
    assert [(b.low, b.high, b.claims, b.came_true) for b in found] == [
        (0.0, 0.2, 1, 0.0),
        (0.8, 0.95, 2, 0.5),
        (0.95, 1.0, 1, 1.0),
    ]
    assert found[1].claimed == pytest.approx(0.875)


def test_unexplained_makes_no_claim_of_a_set():
    assert scores([judge(truth("hanging_valve", kind="unknown"), said("unexplained"))]).calibration == ()


def test_a_blamed_unknown_effect_is_a_claim_that_did_not_come_true():
    (only,) = scores([judge(truth("hanging_valve", kind="unknown"), said("explained", "end_stop"))]).calibration
    assert only.came_true == 0.0


def test_shares_have_wilsons_interval():
    found = share([True] * 9 + [False])
    assert (found.count, found.of, found.share) == (9, 10, 0.9)
    assert found.ci95 == pytest.approx((0.596, 0.982), abs=1e-3)
    assert share([]).share is None


def test_true_shrinkage_is_that_of_excess_variance():
    prediction = {"noise_floor_n": 2.0, "before_n": 4.0, "rmse_n": 3.0}
    assert true_shrinkage(prediction, 2.0) == pytest.approx(1 - 5 / 12)
    assert true_shrinkage(prediction, 1.0) == pytest.approx(1 - 8 / 15)
    assert true_shrinkage({**prediction, "before_n": 2.02}, 2.0) is None
    assert true_shrinkage({**prediction, "before_n": None}, 2.0) is None


def test_claimed_and_true_shrinkage_are_compared_where_something_was_named():
    prediction = {"noise_floor_n": 2.5, "before_n": 5.0, "rmse_n": 2.7}
    found = scores([judge(truth("gas_spring"), said("explained", "gas_spring"), prediction)]).shrinkage
    assert found.cases == 1
    assert found.true == pytest.approx(1 - (2.7**2 - 2.5**2) / (5.0**2 - 2.5**2))
    assert found.inside_interval.count == 1


def test_detection_is_counted_by_size():
    cases = [
        judge(truth("gas_spring", ratio=1.05), said("no_gap")),
        judge(truth("gas_spring", ratio=3.0), said("explained", "gas_spring")),
    ]
    small, large = scores(cases).effects["gas_spring"].detection
    assert (small.found, small.cases, large.found, large.cases) == (0, 1, 1, 1)
    assert small.high <= large.low


def test_the_table_says_the_figures():
    cases = (
        judge(truth("gas_spring"), said("explained", "end_stop")),
        judge(truth(magnitude=None), said("no_gap")),
        judge(truth("gas_spring"), said("explained", "gas_spring"), name="case_000_wires"),
    )
    trial = Trial(version="1", seed=4, draw="blind", sealed_sha256="ab" * 32, scores=scores(cases), cases=cases)
    text = table(trial)
    assert "all          0/1 = 0 %" in text
    assert "gas_spring" in text
    assert text.startswith("2 cases and 1 of them once more over wires, seed 4,")
    assert "over wires   1/1 = 100 %" in text
