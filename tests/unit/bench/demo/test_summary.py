from bench.demo.summary import describe_late_setpoints


def event(kind, quantity, value):
    return {"kind": kind, "text": "any text", "quantity": quantity, "value": value}


LATE, LATER = event("late", "setpoint_lateness", 0.0123), event("alarm", "setpoint_lateness", 0.03713)
OTHER = [event("alarm", "force_age", 0.12), {"kind": "state", "text": "setpoint lateness is only mentioned"}]


def test_the_largest_lateness_of_setpoints_is_described():
    message = describe_late_setpoints([*OTHER, LATE, LATER, event("alarm", "setpoint_lateness", 0.021)])
    assert "up to 37 ms late" in message
    assert "excluded from fit and prediction" in message


def test_a_recording_without_alarms_on_late_setpoints_has_no_description():
    assert describe_late_setpoints([*OTHER, LATE]) == ""
    assert describe_late_setpoints([]) == ""
