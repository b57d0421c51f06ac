from bench.demo.summary import held_up


def event(kind, quantity, value):
    return {"kind": kind, "text": "in words that nobody has to match", "quantity": quantity, "value": value}


LATE, LATER = event("late", "setpoint_lateness", 0.0123), event("alarm", "setpoint_lateness", 0.03713)
OTHER = [event("alarm", "force_age", 0.12), {"kind": "state", "text": "setpoint lateness is only mentioned"}]


def test_a_recording_in_which_setpoints_were_held_up_says_so_and_for_how_long():
    words = held_up([*OTHER, LATE, LATER, event("alarm", "setpoint_lateness", 0.021)])
    assert "for 37 ms at worst" in words
    assert "left out of fit and prediction" in words


def test_one_in_which_they_were_not_says_nothing():
    assert held_up([*OTHER, LATE]) == ""
    assert held_up([]) == ""
