"""The rig's time: real, accelerated, or stepped by a test. Nothing else in this room asks what time it is."""

import threading
import time
from typing import Protocol

_LONGEST_NAP = 0.05
"""[s] of real time between two looks at a clock that is waited for."""


class Clock(Protocol):
    """Time that never runs back; may be used from any thread."""

    def now_ns(self) -> int:
        """Since the clock began [ns]."""

    def before_ns(self, age_ns: int) -> int:
        """What it showed when ``age_ns`` [ns] of real time less had gone by [ns]."""

    def wait_until(self, instant_ns: int, patience: float = _LONGEST_NAP) -> bool:
        """Wait for an instant [ns].

        Args:
            instant_ns: on this clock.
            patience: [s] of real time after which the wait is given up.

        Returns:
            Whether the instant has come.
        """


class RunningClock:
    """Real time, or time that runs ``speed`` times as fast."""

    def __init__(self, speed: float = 1.0) -> None:
        """A clock that begins now.

        Raises:
            ValueError: the speed is not positive.
        """
        if not speed > 0:
            raise ValueError(f"the clock's speed is {speed:g}; it has to be above 0")
        self.speed = speed
        self._began = time.monotonic_ns()

    def now_ns(self) -> int:
        """Since the clock began [ns]."""
        return self.before_ns(0)

    def before_ns(self, age_ns: int) -> int:
        """What it showed ``age_ns`` [ns] of real time ago [ns]."""
        return int((time.monotonic_ns() - age_ns - self._began) * self.speed)

    def wait_until(self, instant_ns: int, patience: float = _LONGEST_NAP) -> bool:
        """Wait for an instant [ns], at most ``patience`` [s] of real time; whether it has come."""
        ahead = (instant_ns - self.now_ns()) / self.speed * 1e-9  # of real time, which is what is slept
        if ahead > 0:
            time.sleep(min(ahead, patience))
        return self.now_ns() >= instant_ns


class SteppedClock:
    """Time that stands still until it is told to move on."""

    def __init__(self) -> None:
        self._now = 0
        self._moved = threading.Condition()

    def now_ns(self) -> int:
        """Since the clock began [ns]."""
        return self._now

    def before_ns(self, age_ns: int) -> int:
        """The same: real time does not move it."""
        return self._now

    def advance(self, by_ns: int) -> None:
        """Move on.

        Raises:
            ValueError: time would run back.
        """
        if by_ns < 0:
            raise ValueError(f"time cannot run back by {-by_ns} ns")
        with self._moved:
            self._now += by_ns
            self._moved.notify_all()

    def wait_until(self, instant_ns: int, patience: float = _LONGEST_NAP) -> bool:
        """Wait until somebody has moved the clock to an instant [ns], at most ``patience`` [s] of real time."""
        with self._moved:
            return self._moved.wait_for(lambda: self._now >= instant_ns, patience)
