"""What a technician does before a run, without a run: find the reference, clamp a specimen, find its middle, tare.

The drive knows where the rod is only after it was homed, which must not happen with a specimen clamped; positions
count from home, the middle of the travel, until that of a clamped specimen is made their zero.
"""

import threading
from collections.abc import Callable
from typing import TypeAlias

from bench.agent.messages import StepStatus
from bench.agent.steps import MOVING, Step
from bench.errors import RunError
from bench.rig.instruments import Rig
from drivers.errors import DriverError
from drivers.load_cell import LoadCell

Move: TypeAlias = Callable[[float, threading.Event], None]
_ANSWERED_WITHIN = 2.0
"""[s] for all steps in which the rod does not move."""


class Preparation:
    """Steps before a run, each on a thread of its own, so that a stop is heard meanwhile.

    Args:
        rig: connected, with nobody leading the rod.
        move: leads the rod to a place [m] until an event is set.
        tell: told of what happens: kind, words.
        over: called when a step has ended.
    """

    def __init__(self, rig: Rig, move: Move, tell: Callable[[str, str], None], over: Callable[[], None]) -> None:
        self.status: StepStatus | None = None
        """Of the last step; none before the first."""
        self._rig, self._move, self._tell, self._over = rig, move, tell, over
        self._ending = threading.Event()
        self._why = ""
        self._seeking = False
        self._thread: threading.Thread | None = None

    @property
    def going(self) -> bool:
        """Whether a step goes on."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def moving(self) -> bool:
        """Whether one goes on in which the rod moves."""
        return self.going and self.status is not None and self.status.step in MOVING

    def begin(self, step: Step, position: float = 0.0) -> StepStatus:
        """Begin a step, wait a moment for its end, and say how far it is.

        Args:
            step: which.
            position: [m] where ``move`` goes.
        """
        self.status = StepStatus(step=step, outcome="going", words=f"{step} goes on")
        self._ending.clear()
        self._why = ""
        self._thread = threading.Thread(target=self._carry_out, args=(step, position), name=step, daemon=True)
        self._thread.start()
        self._thread.join(_ANSWERED_WITHIN)
        return self.status

    def stop(self, why: str) -> None:
        """Let a step that moves the rod end early, for a reason; from any thread, and waits for nothing."""
        if not self.moving or self._ending.is_set():
            return
        self._why = why
        self._ending.set()
        if self._seeking:
            # Nobody leads the rod then, so the drive itself has to be told, and takes its time to answer.
            threading.Thread(target=self._rig.actuator.make_safe, name="stop", daemon=True).start()

    def wait(self, timeout: float) -> None:
        """Wait [s] for the step to end."""
        if self._thread is not None:
            self._thread.join(timeout)

    def _carry_out(self, step: Step, position: float) -> None:
        self._tell("command", step)
        try:
            self.status = StepStatus(step=step, outcome="done", words=self._done(step, position))
            self._tell("state", self.status.words)
        except (DriverError, RunError) as error:
            self._failed(step, str(error))
        except Exception as error:  # without a word the step would go on for ever
            self._failed(step, f"{step} ended: {error!r}; this is a defect")
        finally:
            self._over()

    def _failed(self, step: Step, words: str) -> None:
        words = f"{self._why}: {words}" if self._why else words
        self.status = StepStatus(step=step, outcome="failed", words=words)
        self._tell("alarm", words)

    def _done(self, step: Step, position: float) -> str:
        """Carry out a step; what is so then, in one sentence."""
        if step == "home":
            self._seek()
            position = 0.0  # where a specimen may be taken; the switch stands beyond that
        if step in MOVING:
            self._move(position, self._ending)
            return f"the rod stands at {_position(self._rig)}"
        return _STILL[step](self._rig)

    def _seek(self) -> None:
        self._seeking = True
        try:
            self._rig.actuator.home()
        finally:
            self._seeking = False


def _mount(rig: Rig) -> str:
    rig.actuator.mount()
    return "a specimen is clamped; move the rod to its middle, then centre"


def _centre(rig: Rig) -> str:
    rig.actuator.centre()
    return f"positions count from the specimen's middle, {1e3 * rig.actuator.origin:.3f} mm from home"


def _unmount(rig: Rig) -> str:
    rig.actuator.unmount()
    return f"nothing is clamped; the rod stands at {_position(rig)} from home"


def _tare(rig: Rig) -> str:
    return f"{_load_cell(rig).tare():.2f} N are taken off the force from now on; force_raw keeps them"


def _clear_tare(rig: Rig) -> str:
    _load_cell(rig).clear_tare()
    return "nothing is taken off the force any more"


_STILL: dict[Step, Callable[[Rig], str]] = {
    "mount": _mount,
    "centre": _centre,
    "unmount": _unmount,
    "tare": _tare,
    "clear-tare": _clear_tare,
}
"""Steps in which nothing moves."""


def _position(rig: Rig) -> str:
    return f"{1e3 * rig.actuator.read('actuator_position').value:.3f} mm"


def _load_cell(rig: Rig) -> LoadCell:
    if isinstance(rig.load_cell, LoadCell):
        return rig.load_cell
    raise RunError(f"{rig.load_cell.name} cannot be tared from here; tare it at its own keys")
