"""State and lease of the agent, and the reasons for which it refuses to start or to reset."""

import threading
import time
from collections.abc import Callable

from bench.agent_protocol import AgentState, LeaseCommand, LeaseStatus, Sender
from bench.recorder import EventReporter
from bench.rig import Acquisition, Rig
from bench.safety import Interlocks
from drivers import DriverError


class Lease:
    """Time for which the bench belongs to one client; it ends by itself, because a client may be killed."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Measure the time by a clock [s]."""
        self._clock = clock
        self._actor, self._description, self._end = "", "", float("-inf")

    def take(self, command: LeaseCommand) -> str:
        """Begin, renew or end the lease of the sender; return the reason of a refusal, empty without one."""
        if obstacle := self.find_obstacle(command.sender):
            return obstacle
        self._actor = command.sender.actor if command.sender is not None else ""
        self._description, self._end = command.description, self._clock() + command.duration_s
        return ""

    def find_obstacle(self, sender: Sender | None) -> str:
        """Return why a sender may not start anything; empty if it may."""
        if self._remaining <= 0 or (sender is not None and sender.actor == self._actor):
            return ""
        return f"{self._description} holds the bench; nothing was started; pause or stop it, or wait for its end"

    def describe(self) -> LeaseStatus | None:
        """Return the holder; None while nobody holds the bench."""
        remaining = self._remaining
        if remaining <= 0:
            return None
        return LeaseStatus(holder=self._actor, description=self._description, until_utc_s=time.time() + remaining)

    @property
    def _remaining(self) -> float:
        return self._end - self._clock()


class StateMachine:
    """State that several threads change; every change is reported.

    Args:
        rig: instruments that are reset after a trip.
        interlocks: limits of the bench, which keep the reason of a trip.
        acquisition: reads the instruments.
        report_event: receives the changes.
    """

    def __init__(
        self, rig: Rig, interlocks: Interlocks, acquisition: Acquisition, report_event: EventReporter
    ) -> None:
        self._rig, self._interlocks, self._acquisition = rig, interlocks, acquisition
        self._report_event = report_event
        self._current: AgentState = "idle"
        self.lease = Lease()
        self.lock = threading.RLock()
        """Lock of the state, with which state and runs are read consistently."""

    @property
    def current(self) -> AgentState:
        """Present state."""
        return self._current

    def change(self, state: AgentState, expected: tuple[AgentState, ...] | None = None) -> None:
        """Change the state; only from one of the expected states, if they are given."""
        with self.lock:
            if state == self._current or (expected is not None and self._current not in expected):
                return
            self._current = state
        self._report_event("state", f"agent {state}")

    def begin_preparing(self, sender: Sender | None = None) -> str:
        """Change to ``preparing`` for a sender; return why nothing can be started, empty if something can."""
        # Check and change in one step: of two commands at the same time, only one may start.
        with self.lock:
            obstacle = self._find_start_obstacle() or self.lease.find_obstacle(sender)
            if not obstacle:
                self.change("preparing")
        return obstacle

    def _find_start_obstacle(self) -> str:
        if self._current == "tripped":
            reason = self._interlocks.trip_reason
            return f"the agent is tripped ({reason}); nothing was started; remove the cause, then reset"
        if self._current != "idle":
            return f"the agent is {self._current}; nothing was started; wait for its end, or stop it"
        return self._describe_failed_instruments("nothing was started; check its wire")

    def find_reset_obstacle(self, is_busy: bool) -> str:
        """Return the reason why a trip cannot be reset; empty if it can.

        Args:
            is_busy: whether a run or setup step has not ended yet.
        """
        if self._current not in ("tripped", "idle"):
            return f"the agent is {self._current}; stop it first"
        if is_busy:
            return "the tripped run or step has not ended yet; try again in a moment"
        return (
            self._describe_failed_instruments("check its wire, then reset") if self._current == "tripped" else ""
        )

    def _describe_failed_instruments(self, consequence: str) -> str:
        failed = ", ".join(self._acquisition.failed_instruments)
        return f"{failed} does not reply; {consequence}" if failed else ""

    def reset_trip(self) -> str:
        """Reset a trip; return the error of an instrument that refuses, else an empty text.

        The lock is not held meanwhile, because the replies of instruments take time. No other command leaves the
        state after a trip.
        """
        if self._current == "idle":
            return ""
        try:
            self._rig.amplifier.reset()
            self._rig.actuator.reset()
        except DriverError as error:
            return str(error)
        self._interlocks.reset()
        self.change("idle")
        return ""
