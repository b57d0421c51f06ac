"""Supervision of one run: the limits that apply to it, and the reactions to its events."""

import contextlib

from bench.agent.supervisor import SafetySupervisor
from bench.methods import Method
from bench.recorder import EventReporter
from bench.rig import Acquisition
from bench.safety import Interlocks, LimitMatrix, make_specimen_matrix
from bench.sequencer import CommandHistory
from drivers import Clock


class RunSupervision:
    """Limits and observer of one run (`bench.sequencer.RunObserver`); a context manager.

    Within the block the method's limits apply in addition to the fixture's, the force age is limited, and failed
    instruments are left alone. At its end all of this is undone, however the run ended.

    Args:
        method: method of the run.
        history: commands of the run.
        interlocks: limits of the bench.
        supervisor: applies the actions of exceeded limits.
        acquisition: reads the instruments.
        clock: bench clock [ns].
        report_event: receives the states of the run.
    """

    def __init__(
        self,
        method: Method,
        history: CommandHistory,
        interlocks: Interlocks,
        supervisor: SafetySupervisor,
        acquisition: Acquisition,
        clock: Clock,
        report_event: EventReporter,
    ) -> None:
        self._specimen_limits = make_specimen_matrix(method)
        self._history, self._interlocks, self._supervisor = history, interlocks, supervisor
        self._acquisition, self._clock, self._report_event = acquisition, clock, report_event
        self._scope = contextlib.ExitStack()

    def __enter__(self) -> None:
        # The move to the start may be outside the method's range, which therefore applies from the arrival on.
        approach_limits: LimitMatrix = {
            quantity: limits for quantity, limits in self._specimen_limits.items() if quantity != "displacement"
        }
        with contextlib.ExitStack() as opening:
            # A reconnected instrument restarts its numbers and its clock, and would be set up during a stroke.
            opening.enter_context(self._acquisition.suspend_reconnection())
            opening.enter_context(self._interlocks.use_limits(approach_limits))
            opening.enter_context(self._interlocks.expect_force(self._clock()))
            opening.enter_context(self._supervisor.follow(self._history))
            self._scope = opening.pop_all()

    def __exit__(self, *_: object) -> None:
        self._scope.close()

    # RunObserver

    def on_state(self, text: str) -> None:
        """Report a change of state."""
        self._report_event("state", text)

    def on_setpoints_active(self, active: bool) -> None:
        """Let the SYNCs of the setpoints request the actuator's samples while they are sent."""
        self._acquisition.set_externally_triggered(active)

    def on_arrived(self) -> None:
        """Apply all limits of the method."""
        self._scope.enter_context(self._interlocks.use_limits(self._specimen_limits))

    def on_late_setpoint(self, now_ns: int, delay: float) -> None:
        """Check the delay of a setpoint."""
        self._supervisor.on_late_setpoint(now_ns, delay)

    def on_setpoints_failed(self, reason: str) -> None:
        """Trip, because the rod is without setpoints."""
        self._supervisor.trip(reason)
