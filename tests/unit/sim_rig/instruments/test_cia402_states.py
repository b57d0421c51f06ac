import pytest

from sim_rig.instruments.cia402_states import DriveState, find_next_state

SHUT_DOWN, SWITCH_ON, ENABLE, QUICK_STOP, NO_VOLTAGE = 0x06, 0x07, 0x0F, 0x0B, 0x00


@pytest.mark.parametrize(
    ("state", "word", "expected"),
    [
        (DriveState.SWITCH_ON_DISABLED, SHUT_DOWN, DriveState.READY),
        (DriveState.READY, SWITCH_ON, DriveState.SWITCHED_ON),
        (DriveState.SWITCHED_ON, ENABLE, DriveState.ENABLED),
        (DriveState.READY, ENABLE, DriveState.ENABLED),
        (DriveState.SWITCH_ON_DISABLED, ENABLE, DriveState.SWITCH_ON_DISABLED),
        (DriveState.ENABLED, QUICK_STOP, DriveState.QUICK_STOP),
        (DriveState.SWITCHED_ON, QUICK_STOP, DriveState.SWITCH_ON_DISABLED),
        (DriveState.QUICK_STOP, ENABLE, DriveState.ENABLED),
        (DriveState.ENABLED, SWITCH_ON, DriveState.SWITCHED_ON),
        (DriveState.ENABLED, SHUT_DOWN, DriveState.READY),
    ],
)
def test_a_controlword_leads_to_the_state_of_cia_402(state, word, expected):
    assert find_next_state(state, word, latched=False) is expected


@pytest.mark.parametrize("state", list(DriveState))
def test_disabling_the_voltage_ends_every_state(state):
    assert find_next_state(state, NO_VOLTAGE, latched=False) is DriveState.SWITCH_ON_DISABLED


def test_only_disabling_the_voltage_ends_a_latched_stop():
    assert find_next_state(DriveState.QUICK_STOP, ENABLE, latched=True) is DriveState.QUICK_STOP
    assert find_next_state(DriveState.QUICK_STOP, SHUT_DOWN, latched=True) is DriveState.QUICK_STOP
    assert find_next_state(DriveState.QUICK_STOP, NO_VOLTAGE, latched=True) is DriveState.SWITCH_ON_DISABLED
