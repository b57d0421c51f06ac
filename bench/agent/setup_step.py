"""Setup steps: operations before a run, such as homing, clamping a specimen, centring and taring.

The drive knows the rod's position only after homing, which must not happen with a specimen clamped. Positions
count from home, the middle of the travel, until the middle of a clamped specimen is made their zero.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import TypeAlias

from bench.agent.timing import OPERATION_TIMING, AgentTiming
from bench.agent_protocol import SetupStatus
from bench.errors import RunError
from bench.recorder import EventReporter
from bench.rig import Rig
from bench.safety import Interlocks, Quantity
from bench.setup_steps import MOVING_STEPS, SetupStep
from drivers import Clock, DriverError
from drivers.load_cell import LoadCell

MoveFunction: TypeAlias = Callable[[float, threading.Event], None]
"""Move of the rod to a position [m], which an event stops."""


class SetupExecutor:
    """Executor of setup steps, each in a thread of its own, so that it can be stopped.

    Args:
        rig: connected rig, without setpoints.
        interlocks: limits of the bench.
        clock: bench clock [ns].
        move: moves the rod.
        report_event: receives the events of the step.
        on_ended: is called when a step has ended.
        timing: waiting times.
    """

    def __init__(
        self,
        rig: Rig,
        interlocks: Interlocks,
        clock: Clock,
        move: MoveFunction,
        report_event: EventReporter,
        on_ended: Callable[[], None],
        timing: AgentTiming = OPERATION_TIMING,
    ) -> None:
        self._rig, self._interlocks, self._clock = rig, interlocks, clock
        self._move, self._report_event, self._on_ended = move, report_event, on_ended
        self._timing = timing
        self._status: SetupStatus | None = None
        self._stop_requested = threading.Event()
        self._stop_reason = ""
        self._homing = False
        self._thread: threading.Thread | None = None

    @property
    def status(self) -> SetupStatus | None:
        """Status of the latest step; None before the first."""
        return self._status

    @property
    def is_running(self) -> bool:
        """True if a step is in progress."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def is_moving(self) -> bool:
        """True if a step that moves the rod is in progress."""
        return self.is_running and self._status is not None and self._status.step in MOVING_STEPS

    def start(self, step: SetupStep, position: float = 0.0) -> SetupStatus:
        """Begin a step, wait a moment for its end, and return its status.

        Args:
            step: the setup step.
            position: target of ``move`` [m].
        """
        self._status = SetupStatus(step=step, outcome="running", message=f"{step} is in progress")
        self._stop_requested.clear()
        self._stop_reason = ""
        self._thread = threading.Thread(target=self._execute, args=(step, position), name=step, daemon=True)
        self._thread.start()
        self._thread.join(self._timing.setup_reply)
        return self._status

    def stop(self, reason: str) -> None:
        """Stop a step that moves the rod; from any thread, without waiting."""
        if not self.is_moving or self._stop_requested.is_set():
            return
        self._stop_reason = reason
        self._stop_requested.set()
        if self._homing:
            # The drive homes by itself, so it has to be stopped by a request, whose reply takes time.
            threading.Thread(target=self._rig.actuator.make_safe, name="stop", daemon=True).start()

    def wait(self, timeout: float) -> None:
        """Wait for the end of the step, up to a timeout [s]."""
        if self._thread is not None:
            self._thread.join(timeout)

    def _execute(self, step: SetupStep, position: float) -> None:
        self._report_event("command", step)
        try:
            with self._supervise(step):
                message = self._perform(step, position)
            self._status = SetupStatus(step=step, outcome="done", message=message)
            self._report_event("state", message)
        except (DriverError, RunError) as error:
            self._record_failure(step, str(error))
        except Exception as error:  # without a result the step would seem to be in progress
            self._record_failure(step, f"{step} failed: {error!r}; internal error, please report")
        finally:
            self._on_ended()

    def _record_failure(self, step: SetupStep, message: str) -> None:
        message = f"{self._stop_reason}: {message}" if self._stop_reason else message
        self._status = SetupStatus(step=step, outcome="failed", message=message)
        self._report_event("alarm", message)

    @contextlib.contextmanager
    def _supervise(self, step: SetupStep) -> Iterator[None]:
        """Limit the force age while the rod moves; the reference switch is beyond the displacement limit."""
        if step not in MOVING_STEPS:
            yield
            return
        ignored: tuple[Quantity, ...] = ("displacement",) if step == "home" else ()
        with self._interlocks.use_limits(ignore=ignored), self._interlocks.expect_force(self._clock()):
            yield

    def _perform(self, step: SetupStep, position: float) -> str:
        """Perform a step; return its result in one sentence."""
        if step == "home":
            self._home()
            position = 0.0  # the reference switch is beyond the range in which a specimen can be clamped
        if step in MOVING_STEPS:
            self._move(position, self._stop_requested)
            return f"the rod is at {_format_position(self._rig)}"
        return _STATIONARY_STEPS[step](self._rig)

    def _home(self) -> None:
        self._homing = True
        try:
            self._rig.actuator.home()
        finally:
            self._homing = False


def _mount(rig: Rig) -> str:
    rig.actuator.mount()
    return "a specimen is clamped; move the rod to its middle, then centre"


def _centre(rig: Rig) -> str:
    rig.actuator.centre()
    return f"positions count from the specimen's middle, {1e3 * rig.actuator.origin:.3f} mm from home"


def _unmount(rig: Rig) -> str:
    rig.actuator.unmount()
    return f"no specimen is clamped; the rod is at {_format_position(rig)} from home"


def _tare(rig: Rig) -> str:
    return f"{_get_load_cell(rig).tare():.2f} N are subtracted from the force from now on; force_raw contains them"


def _clear_tare(rig: Rig) -> str:
    _get_load_cell(rig).clear_tare()
    return "nothing is subtracted from the force any more"


_STATIONARY_STEPS: dict[SetupStep, Callable[[Rig], str]] = {
    "mount": _mount,
    "centre": _centre,
    "unmount": _unmount,
    "tare": _tare,
    "clear-tare": _clear_tare,
}
"""Steps in which the rod does not move."""


def _format_position(rig: Rig) -> str:
    return f"{1e3 * rig.actuator.read('actuator_position').value:.3f} mm"


def _get_load_cell(rig: Rig) -> LoadCell:
    if isinstance(rig.load_cell, LoadCell):
        return rig.load_cell
    raise RunError(f"{rig.load_cell.name} cannot be tared remotely; tare it on its front panel")
