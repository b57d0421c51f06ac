"""Limit matrix: thresholds of two tiers, and the violation with the strongest action."""

import pytest

from bench.methods import load_method
from bench.safety.limits import Action, evaluate_limits, make_specimen_matrix, merge_limits

FIXTURE = {
    "force": {Action.INDICATE: 500.0, Action.TRIP: 1000.0},
    "displacement": {Action.TRIP: 0.05},
}


@pytest.mark.parametrize(
    ("value", "action"),
    [(499.0, None), (-501.0, Action.INDICATE), (1000.0, Action.INDICATE), (-1001.0, Action.TRIP)],
)
def test_strongest_exceeded_action_is_returned_for_either_sign(value, action):
    violation = evaluate_limits(FIXTURE, "force", value)
    assert (violation and violation.action) == action


def test_stricter_tier_wins_for_each_action():
    merged = merge_limits(FIXTURE, {"force": {Action.INDICATE: 700.0, Action.TRIP: 900.0, Action.HOLD: 800.0}})
    assert merged["force"] == {Action.INDICATE: 500.0, Action.HOLD: 800.0, Action.TRIP: 900.0}
    assert merged["displacement"] == FIXTURE["displacement"]


def test_method_limits_become_stops_and_a_trip():
    method = load_method("six_currents")
    matrix = make_specimen_matrix(method)
    assert evaluate_limits(matrix, "force", 1.01 * method.limits.force_n).action is Action.CONTROLLED_STOP
    assert evaluate_limits(matrix, "force", 1.3 * method.limits.force_n).action is Action.TRIP
    assert evaluate_limits(matrix, "coil_current", 1.1 * method.limits.drive).action is Action.CONTROLLED_STOP
    assert evaluate_limits(matrix, "coil_voltage", 24.0) is None
    assert evaluate_limits(matrix, "displacement", method.limits.stroke_m) is None


@pytest.mark.parametrize(
    ("quantity", "value", "message"),
    [
        ("following_error", -8.6991e-3, "following error -8.699 mm exceeds the limit of 8 mm"),
        ("setpoint_lateness", 0.0251, "setpoint lateness 25.1 ms exceeds the limit of 8 ms"),
    ],
)
def test_message_uses_a_unit_that_suits_the_quantity(quantity, value, message):
    assert str(evaluate_limits({quantity: {Action.TRIP: 8e-3}}, quantity, value)) == message
