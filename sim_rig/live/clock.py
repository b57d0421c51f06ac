"""Time of the simulated rig: real, accelerated, or stepped by a test."""

import threading
import time
from typing import Protocol

_MAX_SLEEP = 0.05
"""[s] of real time after which a wait for the clock returns, unless told otherwise."""


class RigClock(Protocol):
    """Monotonic time of the rig; may be used from any thread."""

    def now_ns(self) -> int:
        """Return the time since the clock began [ns]."""

    def read_past_ns(self, age_ns: int) -> int:
        """Return the reading of the clock ``age_ns`` [ns] of real time ago [ns]."""

    def wait_until(self, instant_ns: int, timeout: float = _MAX_SLEEP) -> bool:
        """Wait for an instant [ns].

        Args:
            instant_ns: on this clock.
            timeout: [s] of real time after which the wait ends.

        Returns:
            Whether the clock has reached the instant.
        """


class RunningClock:
    """Real time, or time that runs ``speed`` times as fast."""

    def __init__(self, speed: float = 1.0) -> None:
        """Start a clock at zero.

        Raises:
            ValueError: the speed is not positive.
        """
        if not speed > 0:
            raise ValueError(f"the clock's speed is {speed:g}; it must be above 0")
        self.speed = speed
        self._start_ns = time.monotonic_ns()

    def now_ns(self) -> int:
        """Return the time since the clock began [ns]."""
        return self.read_past_ns(0)

    def read_past_ns(self, age_ns: int) -> int:
        """Return the reading of the clock ``age_ns`` [ns] of real time ago [ns]."""
        return int((time.monotonic_ns() - age_ns - self._start_ns) * self.speed)

    def wait_until(self, instant_ns: int, timeout: float = _MAX_SLEEP) -> bool:
        """Wait for an instant [ns], at most ``timeout`` [s] of real time; return whether it is reached."""
        real_time_left = (instant_ns - self.now_ns()) / self.speed * 1e-9
        if real_time_left > 0:
            time.sleep(min(real_time_left, timeout))
        return self.now_ns() >= instant_ns


class SteppedClock:
    """Time that only a call of `advance` moves."""

    def __init__(self) -> None:
        self._now = 0
        self._changed = threading.Condition()

    def now_ns(self) -> int:
        """Return the time since the clock began [ns]."""
        return self._now

    def read_past_ns(self, age_ns: int) -> int:
        """Return the present reading [ns]: real time does not move this clock."""
        return self._now

    def advance(self, by_ns: int) -> None:
        """Advance by ``by_ns`` [ns].

        Raises:
            ValueError: the step is negative.
        """
        if by_ns < 0:
            raise ValueError(f"time cannot run back by {-by_ns} ns")
        with self._changed:
            self._now += by_ns
            self._changed.notify_all()

    def wait_until(self, instant_ns: int, timeout: float = _MAX_SLEEP) -> bool:
        """Wait until the clock was advanced to an instant [ns], at most ``timeout`` [s] of real time."""
        with self._changed:
            return self._changed.wait_for(lambda: self._now >= instant_ns, timeout)
