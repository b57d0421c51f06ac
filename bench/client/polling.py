"""Repeated requests of a state while a script waits."""

import time
from collections.abc import Callable
from typing import TypeVar

from bench.client.errors import ClientError

State = TypeVar("State")
POLL_PERIOD = 0.5
"""Time [s] between two requests."""


def wait_for_state(
    get_state: Callable[[], State],
    is_reached: Callable[[State], bool],
    timeout: float,
    describe_delay: Callable[[State], str],
    period: float = POLL_PERIOD,
) -> State:
    """Request a state until it is reached, and return it.

    Args:
        get_state: requests the state.
        is_reached: returns whether a state is the awaited one.
        timeout: longest time to wait [s].
        describe_delay: returns the error for the state at the end of this time.
        period: time between two requests [s].

    Raises:
        ClientError: it is not reached in time, or a request fails.
    """
    deadline = time.monotonic() + timeout
    while not is_reached(state := get_state()):
        if time.monotonic() > deadline:
            raise ClientError(describe_delay(state))
        time.sleep(period)
    return state
