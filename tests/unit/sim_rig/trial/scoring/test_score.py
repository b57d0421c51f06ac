import math

import pytest

from sim_rig.trial.cases.folder import DiagnosisOutcome
from sim_rig.trial.scoring.score import (
    NOTHING_LABEL,
    UNKNOWN_LABEL,
    bin_claims,
    compute_proportion,
    compute_scores,
)
from sim_rig.trial.scoring.table import render_table
from sim_rig.trial.scoring.trial_report import TrialReport
from sim_rig.trial.scoring.unseal import MIN_PROBABILITY, compute_true_shrinkage, evaluate_case
from tests.support.trial import SUCCESSFUL, make_diagnosis, make_truth


def evaluate(case, diagnosis, prediction=None, name="case_000"):
    return evaluate_case(case, name, SUCCESSFUL, diagnosis, prediction)


def test_the_true_set_is_correct_with_its_probability():
    result = evaluate(
        make_truth("gas_spring", "end_stop"),
        make_diagnosis("explained", "end_stop", "gas_spring", probability=0.7),
    )
    assert (result.correct, result.correct_or_alternative, result.truth_probability) == (True, True, 0.7)


@pytest.mark.parametrize("names", [("gas_spring",), ("gas_spring", "end_stop", "moving_mass"), ("moving_mass",)])
def test_missing_further_or_other_effects_are_not_correct(names):
    result = evaluate(make_truth("gas_spring", "end_stop"), make_diagnosis("explained", *names))
    assert (result.correct, result.correct_or_alternative, result.truth_probability) == (
        False,
        False,
        MIN_PROBABILITY,
    )


def test_a_listed_alternative_counts_with_its_own_probability():
    others = [{"effects": ["moving_mass"], "probability": 0.05}, {"effects": ["gas_spring"], "probability": 0.2}]
    result = evaluate(make_truth("gas_spring"), make_diagnosis("explained", "end_stop", alternatives=others))
    assert (result.correct, result.correct_or_alternative, result.truth_probability) == (False, True, 0.2)


def test_only_no_gap_is_correct_without_effects():
    assert evaluate(make_truth(), make_diagnosis("no_gap", probability=0.95)).truth_probability == 0.95
    assert evaluate(make_truth(), make_diagnosis("no_gap")).correct
    assert not evaluate(make_truth(), make_diagnosis("explained", "gas_spring")).correct
    assert not evaluate(make_truth(), make_diagnosis("unexplained")).correct


def test_an_unknown_effect_requires_a_gap_without_a_name():
    unknown = make_truth("hanging_valve", kind="unknown")
    assert evaluate(unknown, make_diagnosis("unexplained", unknown_probability=0.6)).correct
    assert evaluate(unknown, make_diagnosis("unexplained", unknown_probability=0.6)).truth_probability == 0.6
    assert not evaluate(unknown, make_diagnosis("partly_explained", "seal_friction")).correct
    assert not evaluate(unknown, make_diagnosis("no_gap")).correct


def test_an_unexplained_library_effect_is_not_correct():
    result = evaluate(make_truth("gas_spring"), make_diagnosis("unexplained"))
    assert (result.correct, result.truth_probability) == (False, MIN_PROBABILITY)


def test_a_case_without_a_diagnosis_counts_as_not_correct():
    failed = evaluate_case(
        make_truth("gas_spring"), "case_000", DiagnosisOutcome(seconds=3.0, failure="it crashed"), None
    )
    result = compute_scores(
        [failed, evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring"))]
    )
    assert result.failures == 1
    assert (result.correct["all"].count, result.correct["all"].total) == (1, 2)
    assert result.seconds_max == 12.0


def test_groups_false_alarms_and_unknown_effects():
    cases = [
        evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring")),
        evaluate(
            make_truth("gas_spring", magnitude="small", method="poor"), make_diagnosis("explained", "end_stop")
        ),
        evaluate(make_truth("gas_spring", "end_stop"), make_diagnosis("explained", "gas_spring", "end_stop")),
        evaluate(make_truth(magnitude=None), make_diagnosis("explained", "end_stop")),
        evaluate(make_truth(magnitude=None), make_diagnosis("no_gap")),
        evaluate(make_truth("hanging_valve", kind="unknown"), make_diagnosis("unexplained")),
        evaluate(make_truth("hanging_valve", kind="unknown"), make_diagnosis("explained", "end_stop")),
    ]
    result = compute_scores(cases)
    first = {name: (group.count, group.total) for name, group in result.correct.items()}
    assert first["all"] == (2, 3)
    assert first["large"] == (2, 2)
    assert first["small poor"] == (0, 1)
    assert first["pair"] == (1, 1)
    assert first["triple"] == (0, 0)
    assert (result.false_alarms.count, result.false_alarms.total) == (1, 2)
    assert (result.no_gap_correct.count, result.unknown_correct.count) == (1, 1)
    assert result.confusion[f"hanging_valve {UNKNOWN_LABEL}"] == {UNKNOWN_LABEL: 1, "end_stop": 1}
    assert result.confusion[NOTHING_LABEL] == {NOTHING_LABEL: 1, "end_stop": 1}
    assert result.confusion["gas_spring"] == {"gas_spring": 1, "end_stop": 1}
    assert (result.effects["gas_spring"].cases, result.effects["gas_spring"].detected) == (3, 2)
    assert result.effects["end_stop"].false_alarms == 3


@pytest.mark.parametrize(
    ("verdict", "probability", "share", "blamed"),
    [
        ("explained", 0.6, 0.3, True),
        ("partly_explained", 0.95, 0.6, True),
        ("partly_explained", 0.95, 0.5, False),
        ("partly_explained", 0.9, 0.6, False),
        ("unexplained", 0.1, 0.1, False),
    ],
)
def test_an_unknown_effect_is_blamed_on_a_known_one_by_a_confident_answer(verdict, probability, share, blamed):
    effects = [{"name": "end_stop", "probability": probability, "share": share}]
    case = evaluate(make_truth("hanging_valve", kind="unknown"), make_diagnosis(verdict, effects=effects))
    score = compute_scores([case, evaluate(make_truth("gas_spring"), make_diagnosis("explained", "end_stop"))])
    assert (score.unknown_blamed.count, score.unknown_blamed.total) == (int(blamed), 1)


@pytest.mark.parametrize(
    ("rmse", "interval", "holds"),
    [
        (2.70, [0.99, 1.0], False),
        (2.58, [0.99, 1.0], True),
        (2.70, [0.90, 0.99], True),
    ],
    ids=["far and outside", "close", "inside"],
)
def test_a_claimed_shrinkage_holds_within_five_points_or_its_interval(rmse, interval, holds):
    gap = make_diagnosis("explained")["gap"] | {"shrinkage": 1.0, "shrinkage_ci95": interval}
    prediction = {"noise_floor_n": 2.5, "before_n": 5.0, "rmse_n": rmse}
    case = evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring", gap=gap), prediction)
    result = compute_scores([case]).shrinkage.close_or_within
    assert (result.count, result.total) == (int(holds), 1)


def test_the_log_score_is_the_mean_over_all_diagnoses():
    cases = [
        evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring", probability=0.5)),
        evaluate(make_truth("gas_spring"), make_diagnosis("explained", "end_stop", probability=0.9)),
    ]
    assert compute_scores(cases).log_score == pytest.approx((math.log(0.5) + math.log(MIN_PROBABILITY)) / 2)


def test_a_calibration_curve_compares_claims_with_observations():
    result = bin_claims([(0.9, True), (0.85, False), (0.1, False), (1.0, True)])
    assert [(b.low, b.high, b.count, b.observed) for b in result] == [
        (0.0, 0.2, 1, 0.0),
        (0.8, 0.95, 2, 0.5),
        (0.95, 1.0, 1, 1.0),
    ]
    assert result[1].predicted == pytest.approx(0.875)


def test_unexplained_claims_no_set():
    assert (
        compute_scores(
            [evaluate(make_truth("hanging_valve", kind="unknown"), make_diagnosis("unexplained"))]
        ).calibration
        == ()
    )


def test_a_set_named_for_an_unknown_effect_is_a_false_claim():
    (only,) = compute_scores(
        [evaluate(make_truth("hanging_valve", kind="unknown"), make_diagnosis("explained", "end_stop"))]
    ).calibration
    assert only.observed == 0.0


def test_proportions_have_wilsons_interval():
    result = compute_proportion([True] * 9 + [False])
    assert (result.count, result.total, result.fraction) == (9, 10, 0.9)
    assert result.ci95 == pytest.approx((0.596, 0.982), abs=1e-3)
    assert compute_proportion([]).fraction is None


def test_true_shrinkage_is_that_of_excess_variance():
    prediction = {"noise_floor_n": 2.0, "before_n": 4.0, "rmse_n": 3.0}
    assert compute_true_shrinkage(prediction, 2.0) == pytest.approx(1 - 5 / 12)
    assert compute_true_shrinkage(prediction, 1.0) == pytest.approx(1 - 8 / 15)
    assert compute_true_shrinkage({**prediction, "before_n": 2.02}, 2.0) is None
    assert compute_true_shrinkage({**prediction, "before_n": None}, 2.0) is None


def test_claimed_and_observed_shrinkage_are_compared_for_named_effects():
    prediction = {"noise_floor_n": 2.5, "before_n": 5.0, "rmse_n": 2.7}
    result = compute_scores(
        [evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring"), prediction)]
    ).shrinkage
    assert result.cases == 1
    assert result.observed == pytest.approx(1 - (2.7**2 - 2.5**2) / (5.0**2 - 2.5**2))
    assert result.within_ci95.count == 1


def test_detection_is_counted_by_size():
    cases = [
        evaluate(make_truth("gas_spring", ratio=1.05), make_diagnosis("no_gap")),
        evaluate(make_truth("gas_spring", ratio=3.0), make_diagnosis("explained", "gas_spring")),
    ]
    small, large = compute_scores(cases).effects["gas_spring"].detection
    assert (small.detected, small.cases, large.detected, large.cases) == (0, 1, 1, 1)
    assert small.high <= large.low


def test_the_table_contains_the_scores():
    cases = (
        evaluate(make_truth("gas_spring"), make_diagnosis("explained", "end_stop")),
        evaluate(make_truth(magnitude=None), make_diagnosis("no_gap")),
        evaluate(make_truth("gas_spring"), make_diagnosis("explained", "gas_spring"), name="case_000_wires"),
    )
    trial = TrialReport(
        version="1", seed=4, kind="blind", sealed_sha256="ab" * 32, scores=compute_scores(cases), cases=cases
    )
    text = render_table(trial)
    assert "all          0/1 = 0 %" in text
    assert "gas_spring" in text
    assert text.startswith("2 cases and 1 of them again over wires, seed 4,")
    assert "over wires   1/1 = 100 %" in text
    assert "unknown effects blamed on known ones" in text
