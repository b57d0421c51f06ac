"""States of a CiA 402 drive, and the transitions by its controlword."""

from collections.abc import Callable
from enum import Enum


class DriveState(Enum):
    """Drive states; the value is the low byte of the statusword."""

    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


_COMMANDS: tuple[tuple[Callable[[int], bool], dict[DriveState, DriveState]], ...] = (
    (lambda word: not word & 0x02, dict.fromkeys(DriveState, DriveState.SWITCH_ON_DISABLED)),
    (
        lambda word: not word & 0x04,
        {
            DriveState.READY: DriveState.SWITCH_ON_DISABLED,
            DriveState.SWITCHED_ON: DriveState.SWITCH_ON_DISABLED,
            DriveState.ENABLED: DriveState.QUICK_STOP,
        },
    ),
    (
        lambda word: not word & 0x01,
        {
            DriveState.SWITCH_ON_DISABLED: DriveState.READY,
            DriveState.SWITCHED_ON: DriveState.READY,
            DriveState.ENABLED: DriveState.READY,
        },
    ),
    (
        lambda word: not word & 0x08,
        {DriveState.READY: DriveState.SWITCHED_ON, DriveState.ENABLED: DriveState.SWITCHED_ON},
    ),
    (
        lambda word: True,
        {
            DriveState.READY: DriveState.ENABLED,
            DriveState.SWITCHED_ON: DriveState.ENABLED,
            DriveState.QUICK_STOP: DriveState.ENABLED,
        },
    ),
)
"""Commands of the controlword, of which the first match applies.

In this order: disable voltage, quick stop, shut down, switch on, enable.
"""


def find_next_state(state: DriveState, word: int, latched: bool) -> DriveState:
    """Return the state after a controlword; only disabling the voltage ends a latched stop."""
    for matches, transitions in _COMMANDS:
        if matches(word):
            target = transitions.get(state, state)
            return state if latched and target is not DriveState.SWITCH_ON_DISABLED else target
    return state
