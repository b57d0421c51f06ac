"""Growing waits between the attempts of an action that fails."""

FIRST_WAIT = 1.0
"""[s] Wait after the first failure; each further one doubles it."""
LONGEST_WAIT = 300.0
"""[s] Wait that no further failure makes longer."""


class GrowingWait:
    """Wait before the next attempt of an action; the time [s] is an argument."""

    def __init__(self) -> None:
        self._failures, self._due = 0, float("-inf")

    def fail(self, now: float) -> None:
        """Note a failed attempt."""
        self._due = now + min(FIRST_WAIT * 2.0**self._failures, LONGEST_WAIT)
        # The count has an end, because a power of it would overflow after years.
        self._failures = min(self._failures + 1, 60)

    def find_rest(self, now: float) -> float:
        """Return the time until the next attempt [s]; 0 if it may begin."""
        return max(0.0, self._due - now)
