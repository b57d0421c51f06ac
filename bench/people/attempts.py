"""Count of failed sign-ins, with a growing wait."""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

FREE_ATTEMPTS = 5
"""Number of failures in a row without a wait."""
FIRST_WAIT = 30.0
"""Wait after the failure that follows [s]; each further one doubles it."""
MAX_WAIT = 900.0
"""Longest wait [s]: a person who was locked out by others gets in again."""
MAX_KEYS = 10_000
"""Largest number of keys in memory; the oldest are forgotten."""


@dataclass
class _Failures:
    count: int = 0
    until: float = 0.0


class AttemptCounter:
    """Failed attempts for each key, such as a user name or a client's address; safe from any thread.

    The count is kept in memory, because only the owner of the machine can restart the service.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Use a clock [s] that never steps back."""
        self._clock, self._lock = clock, Lock()
        self._failures: OrderedDict[str, _Failures] = OrderedDict()

    def get_wait(self, key: str) -> float:
        """Return the time until the next attempt is accepted [s]; 0 if it is accepted now."""
        with self._lock:
            found = self._failures.get(key)
            return 0.0 if found is None else max(0.0, found.until - self._clock())

    def record_failure(self, key: str) -> None:
        """Count a failed attempt."""
        with self._lock:
            found = self._failures.setdefault(key, _Failures())
            self._failures.move_to_end(key)
            found.count += 1
            excess = found.count - FREE_ATTEMPTS
            if excess >= 0:
                found.until = self._clock() + min(MAX_WAIT, FIRST_WAIT * 2.0 ** min(excess, 10))
            if len(self._failures) > MAX_KEYS:
                self._failures.popitem(last=False)

    def record_success(self, key: str) -> None:
        """Forget the failures of a key."""
        with self._lock:
            self._failures.pop(key, None)
