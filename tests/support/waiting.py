"""Waiting for what another thread or process does."""

import time
from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")

_TIMEOUT = 30.0
"""Time after which a condition counts as never met [s]."""


def wait_until(condition: Callable[[], Value]) -> Value:
    """Return the first true value of a condition."""
    deadline = time.monotonic() + _TIMEOUT
    while not (value := condition()):
        assert time.monotonic() < deadline, f"the condition was not met in {_TIMEOUT:.0f} s"
        time.sleep(0.001)
    return value
