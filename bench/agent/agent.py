"""Rig agent: owns instruments, interlocks, sequencer and recorder; nothing else writes to a wire.

The agent is idle, preparing, running, stopping or tripped. Samples arrive on one thread per wire, where the
interlocks check them at once. The recording thread aligns, records and publishes them. A run has a thread of its
own, and its setpoints have another.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from bench.agent.run_executor import RunExecutor, find_log_folder
from bench.agent.run_slot import RunSlot
from bench.agent.setup_step import SetupExecutor
from bench.agent.state_machine import StateMachine
from bench.agent.status import (
    collect_warnings,
    describe_bench,
    find_travel,
    make_instrument_statuses,
    make_limit_statuses,
)
from bench.agent.supervisor import SafetySupervisor
from bench.agent.timing import OPERATION_TIMING, AgentTiming, BenchClock
from bench.agent_protocol import (
    AgentEvent,
    AgentState,
    AgentStatus,
    BenchDescription,
    LeaseCommand,
    PrepareCommand,
    Reply,
    RunCommand,
    RunStatus,
)
from bench.config import BenchConfig, compute_identity
from bench.disk import SpaceMonitor
from bench.endings import ABORT_REASON, SHUT_DOWN_REASON, STOP_REASON, RunEnding
from bench.errors import BenchError, LogError
from bench.live import BatchMaker, LiveBatch
from bench.log import list_sample_units
from bench.methods import NO_SEGMENT
from bench.recorder import RecordingThread
from bench.rig import (
    PRIORITY_STEP,
    Acquisition,
    Aligner,
    Batch,
    build_rig,
    check_priority,
    freeze_memory,
    raise_priority,
    reset_priority,
    run_with_priority,
)
from bench.safety import Action, Interlocks
from bench.sequencer import move_rod
from drivers import DriverError, Frame

MessageSink: TypeAlias = Callable[[AgentStatus | LiveBatch | AgentEvent], None]

_STATUS_PERIOD = 0.25
"""[s] Longest interval between two published statuses."""
_SWITCH_INTERVAL = 2e-4
"""[s] Time after which a computing thread yields the interpreter, so that setpoints are not delayed by it."""
_SHUTDOWN_TIMEOUT = 20.0
"""[s] Time for a run to stop when the agent is shut down."""


class Agent:
    """Rig agent; a context manager that keeps all wires open.

    Args:
        config: configuration of the bench.
        source: file of the configuration, attached to every log; logs are stored beside it.
        publish: receives the published messages from any thread; must not wait.
        timing: waiting times.
    """

    def __init__(
        self,
        config: BenchConfig,
        source: Path | None = None,
        publish: MessageSink = lambda message: None,
        timing: AgentTiming = OPERATION_TIMING,
    ) -> None:
        """Build everything without opening a wire.

        Raises:
            DriverError: a driver refuses a setting.
        """
        self._config, self._publish = config, publish
        self._config_identity = compute_identity(config)
        self._clock = BenchClock()
        self._priority_warning = check_priority()
        self._rig = build_rig(config, self._clock, realtime=not self._priority_warning)
        self._interlocks = Interlocks(config.limits.make_limit_matrix(), self._rig.drive_channel)
        actuator = self._rig.actuator
        self._acquisition = Acquisition(
            {one.name: one.instrument for one in self._rig.instruments},
            self._on_batch,
            self._on_instrument_failed,
            idle={actuator.name: actuator},
        )
        self._supervisor = SafetySupervisor(
            self._rig, self._interlocks, self._clock, self._acquisition.maps, self._report_event, self._stop_moving
        )
        aligner = Aligner(self._acquisition.maps, self._rig.drive_channel)
        batch_maker = BatchMaker(list_sample_units(self._rig.drive_unit))
        self._recording_thread = RecordingThread(
            aligner, batch_maker, self._clock, publish, self._on_cycle, self._on_log_failed
        )
        self._executor = RunExecutor(
            config, source, self._rig, self._interlocks, self._supervisor, self._acquisition,
            self._recording_thread, self._clock, self._report_event, timing,
        )  # fmt: skip
        self._states = StateMachine(self._rig, self._interlocks, self._acquisition, self._report_event)
        self._setup = SetupExecutor(
            self._rig, self._interlocks, self._clock, self._move, self._report_event, self._on_setup_ended, timing
        )
        self._run_slot = RunSlot(self._states.lock, self._executor.execute, self._on_run_ended)
        self._space_monitor = SpaceMonitor(find_log_folder(config, source))
        self._published_content: tuple[AgentState, str] | None = None
        self._published_at = 0.0
        self._open_resources = contextlib.ExitStack()
        for one in self._rig.instruments:
            one.instrument.add_listener(partial(self._on_frame, one.name))

    def __enter__(self) -> "Agent":
        """Open all wires and begin to read.

        Raises:
            DriverError: an instrument does not reply as expected; all wires are closed again.
        """
        sys.setswitchinterval(_SWITCH_INTERVAL)
        run_with_priority(self._open_all)
        freeze_memory()
        # This thread makes the statuses. Suspended while it holds the interpreter, it would delay the setpoints.
        raise_priority(-PRIORITY_STEP)
        return self

    def _open_all(self) -> None:
        with contextlib.ExitStack() as opening:
            # Closed in reverse order, so that no thread reads from a wire when it is closed.
            opening.enter_context(self._rig.connect_all())
            opening.callback(self._acquisition.stop)
            self._acquisition.start()
            opening.enter_context(self._recording_thread)
            self._acquisition.enable_reconnection()
            self._executor.note_connection()
            self._open_resources = opening.pop_all()

    def __exit__(self, *_: object) -> None:
        self.shut_down()
        self._open_resources.close()
        reset_priority()

    # Commands

    def get_status(self) -> AgentStatus:
        """Return the state of the agent, its instruments and its runs."""
        with self._states.lock:
            state, finished = self._states.current, self._run_slot.finished
        return AgentStatus(
            state=state,
            utc_s=time.time(),
            trip=self._interlocks.trip_reason,
            reference_state=self._rig.actuator.reference_state.value,
            step=self._setup.status,
            run=self._run_slot.get_status(),
            finished=finished,
            instruments=make_instrument_statuses(self._rig.instruments, self._acquisition, self._clock),
            warnings=collect_warnings(
                self._acquisition,
                self._priority_warning,
                self._rig.actuator.settings.setpoint_timeout,
                self._space_monitor.describe(),
            ),
            limits=make_limit_statuses(self._interlocks.limits),
            travel_m=find_travel(self._rig.actuator),
            drive_kind=self._rig.drive_kind,
            drive_unit=self._rig.drive_unit,
            lease=self._states.lease.describe(),
            config_identity=self._config_identity,
        )

    def describe(self) -> BenchDescription:
        """Return the description of the bench in the configuration."""
        return describe_bench(self._config, self._rig)

    def get_run_status(self) -> RunStatus | None:
        """Return the status of the run in progress or of the latest run; None before the first."""
        return self._run_slot.get_status()

    def run(self, command: RunCommand) -> Reply:
        """Start a run; reply as soon as it is accepted."""
        if obstacle := self._states.begin_preparing(command.sender):
            return Reply(ok=False, error=obstacle, status=self.get_status())
        # Without a lock, because compiling takes time; the state excludes other commands.
        try:
            self._run_slot.start(self._executor.prepare(command))
        except Exception as error:
            self._states.change("idle", expected=("preparing",))
            if not isinstance(error, BenchError | DriverError):
                raise
            return Reply(ok=False, error=str(error), status=self.get_status())
        return Reply(ok=True, status=self.get_status())

    def prepare(self, command: PrepareCommand) -> Reply:
        """Start a setup step; reply when it is done, or after a moment while it continues."""
        if obstacle := self._states.begin_preparing(command.sender):
            return Reply(ok=False, error=obstacle, status=self.get_status())
        status = self._setup.start(command.step, command.position_m or 0.0)
        failed = status.outcome == "failed"
        return Reply(ok=not failed, error=status.message if failed else "", status=self.get_status())

    def lease(self, command: LeaseCommand) -> Reply:
        """Give the sender the lease of the bench, renew it, or end it."""
        obstacle = self._states.lease.take(command)
        return Reply(ok=not obstacle, error=obstacle, status=self.get_status())

    def stop(self) -> Reply:
        """Stop a run or a setup step softly; harmless if nothing is in progress."""
        self._report_event("command", "stop")
        self._stop_moving(STOP_REASON, False, "stopped")
        return Reply(ok=True, status=self.get_status())

    def pause(self) -> Reply:
        """End the run at its next checkpoint, with everything at rest; the status contains its time."""
        run = self._run_slot.current
        if run is None:
            return Reply(ok=False, error="no run is in progress; nothing was paused", status=self.get_status())
        self._report_event("command", "pause")
        run.pause()
        return Reply(ok=True, status=self.get_status())

    def abort(self) -> Reply:
        """Trip at once, by a person; latches, also if nothing is in progress."""
        self._report_event("command", "abort")
        self._supervisor.trip(ABORT_REASON, by_person=True)
        return Reply(ok=True, status=self.get_status())

    def reset(self) -> Reply:
        """Reset a trip whose cause is removed; nothing moves."""
        self._report_event("command", "reset")
        is_busy = self._run_slot.current is not None or self._setup.is_running
        error = self._states.find_reset_obstacle(is_busy) or self._states.reset_trip()
        return Reply(ok=not error, error=error, status=self.get_status())

    def shut_down(self) -> None:
        """Stop a run or setup step softly and bring everything to rest; harmless if repeated."""
        self._stop_moving(SHUT_DOWN_REASON, False, "stopped")
        self._setup.wait(_SHUTDOWN_TIMEOUT)
        self._run_slot.wait(_SHUTDOWN_TIMEOUT)

    def wait(self, timeout: float) -> bool:
        """Wait for the run to end, up to a timeout [s]; return whether there is none in progress."""
        return self._run_slot.wait(timeout)

    # Motion

    def _stop_moving(self, reason: str, hold: bool, ending: RunEnding = "tripped") -> None:
        """Stop a run or setup step softly; from any thread, harmless if nothing is in progress.

        Args:
            reason: for a person.
            hold: keep the rod at its position until the next stop.
            ending: ending of the run; without a request by a person, the bench itself has ended it.
        """
        run = self._run_slot.current
        if run is not None:
            run.stop(reason, hold, ending)
        if self._interlocks.trip_reason:
            self._states.change("tripped")
        elif run is not None:
            self._states.change("stopping", expected=("preparing", "running"))
        else:
            self._setup.stop(reason)

    def _move(self, target: float, stop_requested: threading.Event) -> None:
        """Move the rod to a position [m] without a run."""
        move_rod(
            self._rig.actuator,
            self._interlocks.permit,
            self._clock,
            self._acquisition.set_externally_triggered,
            target,
            stop_requested,
        )

    def _on_setup_ended(self) -> None:
        self._states.change("idle", expected=("preparing",))

    def _on_run_ended(self, status: RunStatus) -> None:
        self._states.change("tripped" if self._interlocks.trip_reason else "idle")
        self._report_event("run_finished", f"{status.id}: {status.outcome} {status.reason}".strip())

    # On the threads of wires

    def _on_batch(self, batch: Batch) -> None:
        # Before everything else, so that limits are checked without delay.
        self._supervisor.on_samples(batch)
        self._recording_thread.feed(batch)
        if (log := self._run_slot.log) is not None:
            log.write_blocks(batch.instrument, batch.blocks)

    def _on_frame(self, name: str, frame: Frame) -> None:
        if (log := self._run_slot.log) is not None:
            log.write_frame(name, frame)

    def _on_instrument_failed(self, name: str, error: DriverError) -> None:
        driver = next(one.driver for one in self._rig.instruments if one.name == name)
        is_in_use = self._run_slot.current is not None or self._setup.is_moving
        # The configured actions stop a motion; while nothing moves, the failure is only indicated.
        action = self._config.silence.get_action(driver) if is_in_use else Action.INDICATE
        self._supervisor.apply(action, str(error))

    # On the recording thread

    def _on_log_failed(self, error: LogError) -> None:
        self._supervisor.apply(Action.CONTROLLED_STOP, str(error))

    def _on_cycle(self) -> None:
        self._supervisor.on_timer()
        run, now = self._run_slot.current, time.monotonic()
        segment = ""
        if run is not None:
            _, index = run.history.find_progress(self._clock())
            segment = "" if index == NO_SEGMENT else run.request.programme.segments[index].name
            if run.history.has_started:
                self._states.change("running", expected=("preparing",))
        content = self._states.current, segment
        if content != self._published_content or now - self._published_at >= _STATUS_PERIOD:
            self._published_content, self._published_at = content, now
            self._publish(self.get_status())

    # Reports

    def _report_event(self, kind: str, text: str, time_ns: int | None = None, **details: Any) -> None:
        """Write an event to the open log, with its details, and publish it."""
        event_ns = self._clock() if time_ns is None else time_ns
        if (log := self._run_slot.log) is not None:
            log.write_event(event_ns, kind, text, **details)
        self._publish(AgentEvent(time_ns=event_ns, kind=kind, text=text))
