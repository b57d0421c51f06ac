"""The states of a CiA 402 drive, and which of them a controlword leads to."""

from collections.abc import Callable
from enum import Enum


class State(Enum):
    """Drive states; the value is the low byte of the statusword."""

    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


_COMMANDS: tuple[tuple[Callable[[int], bool], dict[State, State]], ...] = (
    (lambda word: not word & 0x02, dict.fromkeys(State, State.SWITCH_ON_DISABLED)),
    (
        lambda word: not word & 0x04,
        {
            State.READY: State.SWITCH_ON_DISABLED,
            State.SWITCHED_ON: State.SWITCH_ON_DISABLED,
            State.ENABLED: State.QUICK_STOP,
        },
    ),
    (
        lambda word: not word & 0x01,
        {State.SWITCH_ON_DISABLED: State.READY, State.SWITCHED_ON: State.READY, State.ENABLED: State.READY},
    ),
    (lambda word: not word & 0x08, {State.READY: State.SWITCHED_ON, State.ENABLED: State.SWITCHED_ON}),
    (
        lambda word: True,
        {State.READY: State.ENABLED, State.SWITCHED_ON: State.ENABLED, State.QUICK_STOP: State.ENABLED},
    ),
)
"""What the controlword asks for, the first that holds: disable voltage, quick stop, shut down, switch on, go."""


def next_state(state: State, word: int, latched: bool) -> State:
    """Where a controlword leads; a latched stop is left by disabling the voltage alone."""
    for asks, ways in _COMMANDS:
        if asks(word):
            to = ways.get(state, state)
            return state if latched and to is not State.SWITCH_ON_DISABLED else to
    return state
