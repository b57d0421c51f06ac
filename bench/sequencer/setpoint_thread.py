"""Setpoint generator and setpoint thread: one position setpoint with its SYNC in every cycle.

The drive reaches a setpoint within one cycle, so each setpoint is the position demanded one cycle later. The
thread wakes at absolute deadlines on a grid of cycles and does nothing else. A setpoint that is sent late still
belongs to its place on the grid, so the rod stays synchronous with the trajectory.
"""

import threading
import time
from collections.abc import Callable
from typing import Final, Protocol

from bench.errors import RunError
from bench.rig import PRIORITY_STEP, raise_priority
from bench.sequencer.command_history import CommandEntry, CommandHistory
from bench.sequencer.playback import PlaybackSection
from bench.sequencer.trajectory import ScheduledTrajectory, Trajectory, make_standstill
from drivers import DriverError

PAUSE_SHARE = 0.6
"""Share of the drive's setpoint timeout for which setpoints may be suspended (dimensionless)."""
_MAX_CATCH_UP = 4
"""Largest delay [cycles] for which omitted setpoints are sent afterwards; beyond it, they are skipped."""
_JOIN_TIMEOUT = 2.0
"""[s] Time for the thread to end."""


class PositionSink(Protocol):
    """Actuator that accepts position setpoints."""

    def send_setpoint(self, position: float, due_ns: int) -> None:
        """Send a setpoint [m] that is due at an instant of the bench clock [ns], and its SYNC."""


class SetpointGenerator:
    """Setpoint of each cycle, computed from the scheduled trajectory; may be used from several threads.

    Args:
        actuator: armed actuator.
        permit: checks each position [m] and raises to forbid it.
        history: records each scheduled trajectory.
        cycle: time between setpoints [s].
        setpoint_timeout: time without a setpoint after which the drive stops by itself [s].
    """

    def __init__(
        self,
        actuator: PositionSink,
        permit: Callable[[float], None],
        history: CommandHistory,
        cycle: float,
        setpoint_timeout: float,
    ) -> None:
        self.cycle_ns: Final = round(cycle * 1e9)
        self._actuator, self._permit, self._history = actuator, permit, history
        self._max_suspension_ns = round(PAUSE_SHARE * setpoint_timeout * 1e9)
        self._lock = threading.Lock()
        self._entry: CommandEntry | None = None
        self._next: tuple[Trajectory, PlaybackSection | None] | None = None
        self._suspended_ns: int | None = None
        self._has_expired = False
        self._stopped = False

    @property
    def schedule(self) -> ScheduledTrajectory | None:
        """Trajectory in progress."""
        return None if self._entry is None else self._entry.schedule

    def hold_at(self, position: float) -> None:
        """Hold the rod at a position [m] from the next setpoint on."""
        self.start(make_standstill(position))

    def start(self, trajectory: Trajectory, section: PlaybackSection | None = None) -> bool:
        """Begin a trajectory with the next setpoint, and end a suspension.

        Returns:
            False, with nothing begun, if a suspension has expired or the motion was stopped.
        """
        with self._lock:
            may_start = not self._has_expired and not self._stopped
            if may_start:
                self._next = trajectory, section
            self._suspended_ns, self._has_expired = None, False
            return may_start

    def suspend(self, now_ns: int) -> None:
        """Withhold setpoints and SYNCs until `start`; the rod must be at rest, and the drive holds it."""
        with self._lock:
            self._suspended_ns, self._has_expired = now_ns, False

    def stop(self, now_ns: int, acceleration: float) -> None:
        """Stop the motion softly within an acceleration limit [m/s²]; nothing can be started afterwards."""
        with self._lock:
            self._stopped, self._next, self._suspended_ns = True, None, None
            if self._entry is not None:
                # The setpoint for the next cycle was sent already.
                schedule = self._entry.schedule.add_soft_stop(now_ns + self.cycle_ns, acceleration)
                self._set_entry(CommandEntry(schedule, self._entry.section))

    def is_done(self, now_ns: int) -> bool:
        """Return whether the motion has ended and no trajectory waits to begin."""
        with self._lock:
            has_next = self._next is not None
            return not has_next and (self._entry is None or now_ns >= self._entry.schedule.end_ns + self.cycle_ns)

    def step(self, now_ns: int) -> bool:
        """Send the setpoint of an instant [ns]; return False if none is sent during a suspension.

        Raises:
            InterlockError: the setpoint is forbidden.
            DriverError: the drive refuses it or does not reply.
        """
        with self._lock:
            if self._is_suspended(now_ns):
                return False
            self._begin_next(now_ns)
            if self._entry is None:
                return False
            position = self._entry.schedule.find_position(now_ns + self.cycle_ns)
            self._permit(position)
            self._actuator.send_setpoint(position, now_ns)
            return True

    def _is_suspended(self, now_ns: int) -> bool:
        """Return whether setpoints are withheld; a suspension expires before the drive would stop by itself."""
        if self._suspended_ns is not None and now_ns - self._suspended_ns > self._max_suspension_ns:
            self._suspended_ns, self._has_expired = None, True
        return self._suspended_ns is not None

    def _begin_next(self, now_ns: int) -> None:
        """Begin the trajectory that waits, if any, at the instant of a setpoint [ns]."""
        if self._next is not None:
            trajectory, section = self._next
            self._next = None
            self._set_entry(CommandEntry(ScheduledTrajectory(trajectory, now_ns), section))

    def _set_entry(self, entry: CommandEntry) -> None:
        self._entry = entry
        self._history.add(entry)


class SetpointThread:
    """Thread that calls `SetpointGenerator.step` in every cycle; a context manager.

    Args:
        generator: sends the setpoints.
        clock: bench clock [ns].
        on_late: receives each late setpoint: bench clock [ns] and delay [s].
        on_failed: receives the error that ended the setpoints, once.
    """

    def __init__(
        self,
        generator: SetpointGenerator,
        clock: Callable[[], int],
        on_late: Callable[[int, float], None],
        on_failed: Callable[[Exception], None],
    ) -> None:
        self.late_cycles = 0
        """Number of cycles without a setpoint in time."""
        self.failure: Exception | None = None
        self.warning = ""
        """Reason why the thread has no real-time priority; empty if it has."""
        self._generator, self._clock, self._on_late, self._on_failed = generator, clock, on_late, on_failed
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="setpoints", daemon=True)

    def __enter__(self) -> "SetpointThread":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join(_JOIN_TIMEOUT)

    def _run(self) -> None:
        self.warning = raise_priority(PRIORITY_STEP)
        cycle = self._generator.cycle_ns
        # Whole cycles of the bench clock, by which the threads that read the drive's replies wake, too.
        due = self._clock() // cycle * cycle
        try:
            while not self._stopping.is_set():
                # Relative to the grid, not to now: a late cycle must not delay all later ones.
                due += cycle
                time.sleep(max(due - self._clock(), 0) * 1e-9)
                now = self._clock()
                self._count_late_cycles(now, (now - due) * 1e-9)
                # After a longer delay all omitted setpoints would leave in one burst, so they are skipped.
                if now - due > _MAX_CATCH_UP * cycle:
                    due += (now - due) // cycle * cycle
                # A drive that is locked to SYNC counts the setpoints, so every place of the grid gets its own.
                self._generator.step(due)
        except Exception as error:  # if the thread ended silently, the rod would be without setpoints unnoticed
            self._report_failure(error)

    def _report_failure(self, error: Exception) -> None:
        is_expected = isinstance(error, DriverError | RunError)
        self.failure = (
            error if is_expected else RunError(f"setpoints ended: {error!r}; internal error, please report")
        )
        self._on_failed(self.failure)

    def _count_late_cycles(self, now_ns: int, delay: float) -> None:
        missed = int(delay * 1e9) // self._generator.cycle_ns
        if missed:
            self.late_cycles += missed
            self._on_late(now_ns, delay)
