import pytest

from sim_rig.drive_states import State, next_state

SHUT_DOWN, SWITCH_ON, ENABLE, QUICK_STOP, NO_VOLTAGE = 0x06, 0x07, 0x0F, 0x0B, 0x00


@pytest.mark.parametrize(
    ("state", "word", "then"),
    [
        (State.SWITCH_ON_DISABLED, SHUT_DOWN, State.READY),
        (State.READY, SWITCH_ON, State.SWITCHED_ON),
        (State.SWITCHED_ON, ENABLE, State.ENABLED),
        (State.READY, ENABLE, State.ENABLED),
        (State.SWITCH_ON_DISABLED, ENABLE, State.SWITCH_ON_DISABLED),
        (State.ENABLED, QUICK_STOP, State.QUICK_STOP),
        (State.SWITCHED_ON, QUICK_STOP, State.SWITCH_ON_DISABLED),
        (State.QUICK_STOP, ENABLE, State.ENABLED),
        (State.ENABLED, SWITCH_ON, State.SWITCHED_ON),
        (State.ENABLED, SHUT_DOWN, State.READY),
    ],
)
def test_a_controlword_leads_where_cia_402_says(state, word, then):
    assert next_state(state, word, latched=False) is then


@pytest.mark.parametrize("state", list(State))
def test_without_voltage_every_state_is_left(state):
    assert next_state(state, NO_VOLTAGE, latched=False) is State.SWITCH_ON_DISABLED


def test_a_latched_stop_is_left_by_disabling_the_voltage_alone():
    assert next_state(State.QUICK_STOP, ENABLE, latched=True) is State.QUICK_STOP
    assert next_state(State.QUICK_STOP, SHUT_DOWN, latched=True) is State.QUICK_STOP
    assert next_state(State.QUICK_STOP, NO_VOLTAGE, latched=True) is State.SWITCH_ON_DISABLED
