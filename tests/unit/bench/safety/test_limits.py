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


def test_method_limits_have_exact_margins():
    """5 % for motion and drive, and a trip 25 % above the force."""
    method = load_method("six_currents")
    limits = method.limits
    limits = limits.model_copy(update={"force_n": 800.0, "stroke_m": 0.02, "velocity_mps": 0.4, "drive": 2.0})
    matrix = make_specimen_matrix(method.model_copy(update={"limits": limits}))
    assert matrix["force"] == {Action.CONTROLLED_STOP: 800.0, Action.TRIP: 1000.0}
    assert matrix["displacement"] == {Action.CONTROLLED_STOP: pytest.approx(0.021)}
    assert matrix["actuator_velocity"] == {Action.CONTROLLED_STOP: pytest.approx(0.42)}
    assert matrix["coil_current"] == {Action.CONTROLLED_STOP: pytest.approx(2.1)}
    assert set(matrix) == {"force", "displacement", "actuator_velocity", "coil_current"}


def test_value_at_its_limit_is_permitted():
    assert evaluate_limits(FIXTURE, "force", 500.0) is None
    assert evaluate_limits(FIXTURE, "displacement", -0.05) is None
    assert evaluate_limits(FIXTURE, "temperature", 1e9) is None


@pytest.mark.parametrize(
    ("quantity", "message"),
    [
        ("force", "force 1.5 N exceeds the limit of 0.25 N"),
        ("displacement", "displacement 1500 mm exceeds the limit of 250 mm"),
        ("actuator_velocity", "actuator velocity 1.5 m/s exceeds the limit of 0.25 m/s"),
        ("following_error", "following error 1500 mm exceeds the limit of 250 mm"),
        ("coil_current", "coil current 1.5 A exceeds the limit of 0.25 A"),
        ("coil_voltage", "coil voltage 1.5 V exceeds the limit of 0.25 V"),
        ("temperature", "temperature 1.5 °C exceeds the limit of 0.25 °C"),
        ("force_age", "force age 1500 ms exceeds the limit of 250 ms"),
        ("setpoint_lateness", "setpoint lateness 1500 ms exceeds the limit of 250 ms"),
    ],
)
def test_every_quantity_has_its_unit_in_messages(quantity, message):
    assert str(evaluate_limits({quantity: {Action.HOLD: 0.25}}, quantity, 1.5)) == message


@pytest.mark.parametrize("quantity", ["displacement", "force"])
def test_quantity_of_one_tier_only_is_kept(quantity):
    one = {quantity: {Action.HOLD: 1.0}}
    assert merge_limits(one, {}) == merge_limits({}, one) == one
