"""The rig agent: owns instruments, interlocks, sequencer and recorder; nothing else writes to a wire.

Its state is one of idle, preparing, running, stopping, tripped. Samples come on one thread a wire and are judged
by the interlocks there and then; a thread of its own brings them onto one time base, records and publishes them. A
run is carried out by a thread of its own, its setpoints by another that does nothing else.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from bench.agent.bench_clock import BenchClock
from bench.agent.bench_thread import BenchThread
from bench.agent.header import force_rate
from bench.agent.instrument_status import instrument_status
from bench.agent.messages import (
    AgentEvent,
    AgentState,
    AgentStatus,
    Answer,
    PrepareCommand,
    RunCommand,
    RunStatus,
    Samples,
)
from bench.agent.preparation import Preparation
from bench.agent.runner import Runner
from bench.agent.runs import Runs
from bench.agent.steps import MOVING
from bench.agent.warden import Warden
from bench.errors import BenchError, LogError
from bench.methods.compile import BETWEEN
from bench.rig.acquisition import Acquisition, Batch
from bench.rig.alignment import Aligner
from bench.rig.config import BenchConfig
from bench.rig.instruments import build_rig
from bench.rig.priority import (
    HASTE,
    freeze_memory,
    ordinary_priority,
    priority_refused,
    raise_priority,
    with_priority,
)
from bench.safety.interlocks import Interlocks
from bench.safety.limits import Action
from bench.sequencer.move_rod import move_rod
from drivers.channel import Frame
from drivers.errors import DriverError

Publish: TypeAlias = Callable[[AgentStatus | Samples | AgentEvent], None]

_STATUS_PERIOD = 0.25
"""[s] between two statuses where nothing changes."""
_SWITCH = 2e-4
"""[s] after which a thread that computes lets another one go on: setpoints do not wait for a summary."""
_END_WITHIN = 20.0
"""[s] for a run to end in good order when the agent is shut down."""


class Agent:
    """The agent; a context manager that holds all wires open.

    Args:
        config: of the bench.
        source: its file, kept in every log; logs go beside it.
        publish: takes what is published, from any thread; must not wait.
    """

    def __init__(
        self, config: BenchConfig, source: Path | None = None, publish: Publish = lambda message: None
    ) -> None:
        """Build everything; no wire is opened yet.

        Raises:
            DriverError: a driver refuses a setting.
        """
        self._config, self._publish = config, publish
        self._clock = BenchClock()
        self._no_priority = priority_refused()
        self._rig = build_rig(config, self._clock, prompt=not self._no_priority)
        self._interlocks = Interlocks(config.limits.matrix(), self._rig.drive_channel)
        actuator = self._rig.actuator
        self._acquisition = Acquisition(
            {one.name: one.instrument for one in self._rig.named},
            self._take,
            self._instrument_failed,
            idle={actuator.name: actuator},
        )
        self._warden = Warden(
            self._rig, self._interlocks, self._clock, self._acquisition.maps, self._tell, self._stop_moving
        )
        aligner = Aligner(self._acquisition.maps, self._rig.drive_channel)
        self._bench = BenchThread(aligner, force_rate(config), publish, self._beat, self._log_failed)
        self._runner = Runner(
            config, source, self._rig, self._interlocks, self._warden, self._acquisition, self._bench, self._clock,
            self._tell,
        )  # fmt: skip
        self._lock = threading.RLock()
        self._state: AgentState = "idle"
        self._preparation = Preparation(self._rig, self._move, self._tell, self._prepared)
        self._runs = Runs(self._lock, self._runner.carry_out, self._ended)
        self._told: tuple[AgentState, str] | None = None
        self._told_at = 0.0
        self._open = contextlib.ExitStack()
        for one in self._rig.named:
            one.instrument.listen(partial(self._keep, one.name))

    def __enter__(self) -> "Agent":
        """Open all wires and begin to read.

        Raises:
            DriverError: an instrument does not answer as itself; nothing stays open.
        """
        sys.setswitchinterval(_SWITCH)
        with_priority(self._open_all)
        freeze_memory()
        # Whoever asks for the status holds the interpreter: put aside meanwhile, it would hold up the setpoints.
        raise_priority(-HASTE)
        return self

    def _open_all(self) -> None:
        with contextlib.ExitStack() as opening:
            # Left in the opposite order: nobody reads from a wire any more when it is closed.
            opening.enter_context(self._rig.connected())
            opening.callback(self._acquisition.stop)
            self._acquisition.start()
            opening.enter_context(self._bench)
            self._acquisition.reconnect = True
            self._runner.opened_ns = self._clock()
            self._open = opening.pop_all()

    def __exit__(self, *_: object) -> None:
        self.shut_down()
        self._open.close()
        ordinary_priority()

    # Commands

    def status(self) -> AgentStatus:
        """All that the agent says of itself."""
        with self._lock:
            state, finished = self._state, self._runs.finished
        return AgentStatus(
            state=state,
            trip=self._interlocks.tripped,
            mounting=self._rig.actuator.mounting.value,
            step=self._preparation.status,
            run=self._runs.status(),
            finished=finished,
            instruments=tuple(instrument_status(one, self._acquisition, self._clock) for one in self._rig.named),
            warnings=self._warnings(),
            drive_kind=self._rig.drive_kind,
            drive_unit=self._rig.drive_unit,
        )

    def run_status(self) -> RunStatus | None:
        """The run that goes on, or the last one; none before the first."""
        return self._runs.status()

    def run(self, command: RunCommand) -> Answer:
        """Begin a run; answered as soon as it is accepted."""
        with self._lock:
            if error := self._not_ready():
                return Answer(ok=False, error=error, status=self.status())
            self._set_state("preparing")
        # Without the lock: a method takes its time to compile, and the state keeps everybody else out.
        try:
            self._runs.begin(*self._runner.made(command))
        except Exception as found:
            self._set_state("idle", instead_of=("preparing",))
            if not isinstance(found, BenchError | DriverError):
                raise
            return Answer(ok=False, error=str(found), status=self.status())
        return Answer(ok=True, status=self.status())

    def prepare(self, command: PrepareCommand) -> Answer:
        """Carry out one step before a run; answered when it is done, or after a moment while it goes on."""
        with self._lock:
            if error := self._not_ready():
                return Answer(ok=False, error=error, status=self.status())
            self._set_state("preparing")
        if command.step in MOVING:
            # From now on the silence of the load cell counts.
            self._interlocks.expect_force(self._clock())
        if command.step == "home":  # the reference stands beyond where a specimen may be taken; force is watched
            matrix = self._config.limits.matrix()
            self._interlocks.matrix = {name: steps for name, steps in matrix.items() if name != "displacement"}
        begun = self._preparation.begin(command.step, command.position_m or 0.0)
        failed = begun.outcome == "failed"
        return Answer(ok=not failed, error=begun.words if failed else "", status=self.status())

    def _move(self, target: float, ending: threading.Event) -> None:
        """Lead the rod to a place [m] where no run does."""
        move_rod(self._rig.actuator, self._interlocks.permit, self._clock, self._runner.set_led, target, ending)

    def _prepared(self) -> None:
        self._interlocks.expect_force(None)
        self._interlocks.matrix = self._config.limits.matrix()
        self._set_state("idle", instead_of=("preparing",))

    def stop(self) -> Answer:
        """End the run, or a step before one, in good order; harmless when nothing runs."""
        self._tell("command", "stop")
        self._stop_moving("stopped on request", False)
        return Answer(ok=True, status=self.status())

    def reset(self) -> Answer:
        """Take back a trip whose cause has gone; nothing moves."""
        self._tell("command", "reset")
        error = self._not_resettable() or self._taken_back()
        return Answer(ok=not error, error=error, status=self.status())

    def shut_down(self) -> None:
        """End run or step in good order and bring everything to rest; harmless when repeated."""
        self._stop_moving("the agent was shut down", False)
        self._preparation.wait(_END_WITHIN)
        self._runs.wait(_END_WITHIN)

    def wait(self, timeout: float) -> bool:
        """Wait [s] for the run to end; whether it has."""
        return self._runs.wait(timeout)

    # States

    def _not_ready(self) -> str:
        """Why no run can begin; empty where one can."""
        if self._state != "idle":
            why = f" ({self._interlocks.tripped}); find the cause, then reset" if self._state == "tripped" else ""
            return f"the agent is {self._state}{why}; nothing was started"
        down = ", ".join(self._acquisition.down)
        return f"{down} does not answer; nothing was started; see its wire" if down else ""

    def _ended(self, status: RunStatus) -> None:
        """A run is over, whatever it was that ended it."""
        self._set_state("tripped" if self._interlocks.tripped else "idle")
        self._tell("run_finished", f"{status.id}: {status.outcome} {status.reason}".strip())

    def _stop_moving(self, why: str, hold: bool) -> None:
        """End a run, or a step before one, in good order; from any thread, harmless where nothing goes on."""
        run = self._runs.current
        if run is not None:
            run.sequencer.stop(why, hold)
        if self._interlocks.tripped:
            self._set_state("tripped")
        elif run is not None:
            self._set_state("stopping", instead_of=("preparing", "running"))
        else:
            self._preparation.stop(why)

    def _not_resettable(self) -> str:
        """Why a trip cannot be taken back now; empty where it can."""
        if self._state not in ("tripped", "idle"):
            return f"the agent is {self._state}; stop it first"
        if self._runs.current is not None or self._preparation.going:
            return "what was tripped has not ended yet; try again in a moment"
        down = ", ".join(self._acquisition.down) if self._state == "tripped" else ""
        return f"{down} does not answer; see its wire, then reset" if down else ""

    def _taken_back(self) -> str:
        """Take a trip back; why not, where an instrument refuses.

        The lock is not held meanwhile: instruments take their time, and nothing else leads out of a trip.
        """
        if self._state == "idle":
            return ""
        try:
            self._rig.amplifier.reset()
            self._rig.actuator.reset()
        except DriverError as error:
            return str(error)
        self._interlocks.reset()
        self._set_state("idle")
        return ""

    # On the threads of wires

    def _take(self, batch: Batch) -> None:
        # Judged before anything else is done with it.
        self._warden.look(batch)
        self._bench.feed(batch)
        if (log := self._runs.log) is not None:
            log.blocks(batch.instrument, batch.blocks)

    def _keep(self, name: str, frame: Frame) -> None:
        if (log := self._runs.log) is not None:
            log.frame(name, frame)

    def _instrument_failed(self, name: str, error: DriverError) -> None:
        driver = next(one.driver for one in self._rig.named if one.name == name)
        moves = self._runs.current is not None or self._preparation.moving
        action = self._config.silence.action(driver) if moves else Action.INDICATE
        self._warden.act(action, str(error))

    def _log_failed(self, error: LogError) -> None:
        self._warden.act(Action.CONTROLLED_STOP, str(error))

    # What is said

    def _beat(self) -> None:
        """Every turn of the bench thread."""
        self._warden.tick()
        run, now = self._runs.current, time.monotonic()
        segment = ""
        if run is not None:
            _, index = run.plan.progress(self._clock())
            segment = "" if index == BETWEEN else run.what.programme.segments[index].name
            # The way to where the method begins is no part of it.
            if any(entry.passage for entry in run.plan.entries):
                self._set_state("running", instead_of=("preparing",))
        if (self._state, segment) != self._told or now - self._told_at >= _STATUS_PERIOD:
            self._told, self._told_at = (self._state, segment), now
            self._publish(self.status())

    def _set_state(self, state: AgentState, instead_of: tuple[AgentState, ...] | None = None) -> None:
        """Change the state, where it is one of those that are given."""
        with self._lock:
            if state == self._state or (instead_of is not None and self._state not in instead_of):
                return
            self._state = state
        self._tell("state", f"agent {state}")

    def _tell(self, kind: str, text: str, time_ns: int | None = None, **more: Any) -> None:
        """An event, into the log that is open, with what more is known of it, and to whoever listens."""
        moment = self._clock() if time_ns is None else time_ns
        if (log := self._runs.log) is not None:
            log.event(moment, kind, text, **more)
        self._publish(AgentEvent(time_ns=moment, kind=kind, text=text))

    def _warnings(self) -> tuple[str, ...]:
        # What every thread was refused is said once, with what follows from it.
        found = [sentence for sentence in self._acquisition.warnings if sentence != self._no_priority]
        if self._no_priority:
            stale = self._rig.actuator.settings.stale_after
            found.append(f"{self._no_priority}; the drive stops by itself {stale:g} s after the last setpoint")
        return tuple(found)
