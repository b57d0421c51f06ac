from bench.demo.summary import held_up

LATE = {"kind": "alarm", "text": "setpoint lateness 37.13 ms exceeds the limit of 20 ms"}
OTHER = {"kind": "alarm", "text": "force age 120 ms exceeds the limit of 100 ms"}


def test_a_recording_in_which_setpoints_were_held_up_says_so_with_the_first_of_them():
    words = held_up([OTHER, LATE, {**LATE, "text": "setpoint lateness 21 ms exceeds the limit of 20 ms"}])
    assert "37.13 ms" in words
    assert "21 ms" not in words
    assert "record again" in words


def test_one_in_which_they_were_not_says_nothing():
    assert held_up([OTHER, {"kind": "late", "text": "a setpoint left 12.3 ms late"}]) == ""
