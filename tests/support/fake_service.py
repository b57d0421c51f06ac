"""A rig agent and an engine under the control of a test."""

import queue
import time

from bench.agent.state_machine import Lease
from bench.agent_protocol import (
    AbortCommand,
    AgentStatus,
    AuditCommand,
    AuditPage,
    BenchChannel,
    BenchDescription,
    BenchLimit,
    DescribeCommand,
    LeaseCommand,
    PauseCommand,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    RunStatus,
    SetupStatus,
    StopCommand,
    get_sender,
)
from bench.errors import AgentUnreachableError
from bench.methods import parse_method


class FakeAgent:
    """Accepts runs as the agent does, without a rig; the test ends them."""

    def __init__(self, prefix="run"):
        """Use a prefix for the ids of its runs."""
        self.prefix = prefix
        self.status = AgentStatus(state="idle")
        self.published = queue.Queue()
        self.reachable = True
        self.refuses = ""
        self.setup = None
        """Outcome and message of the setup steps; None leaves the status as it is."""
        self.overdue = ()
        self.failed_checks = ()
        self.commands = []
        self.defect = None
        self.audit = AuditPage(chain="", before="", lines=())
        self.trail = None
        self.lease = Lease()
        self.description = BenchDescription(
            name="bench",
            specimen="mounted damper",
            drive_kind="coil_v",
            drive_unit="V",
            limits={"force": BenchLimit(unit="N", indicate=None, hold=None, controlled_stop=None, trip=5000.0)},
            channels={"force": BenchChannel(unit="N", rate_hz=1000.0, delay_s=0.0)},
        )

    def send(self, command, timeout=5.0):
        if self.defect:
            raise self.defect
        if not self.reachable:
            raise AgentUnreachableError(
                "no rig agent answered at tcp://127.0.0.1:5570 within 1 s; start one: mrbench rig"
            )
        if isinstance(command, DescribeCommand | AuditCommand):
            return self._answer(command)
        if isinstance(command, LeaseCommand):
            return self._take_lease(command)
        self.commands.append(command)
        if refusal := self.refuses or self._find_holder(command):
            return Reply(ok=False, error=refusal, status=self._stamped_status())
        self._execute(command)
        return Reply(ok=True, status=self._stamped_status())

    def _take_lease(self, command):
        error = self.lease.take(command.model_copy(update={"sender": get_sender()}))
        return Reply(ok=not error, error=error, status=self._stamped_status())

    def _find_holder(self, command):
        return self.lease.find_obstacle(get_sender()) if isinstance(command, RunCommand | PrepareCommand) else ""

    def _execute(self, command):
        match command:
            case RunCommand():
                self._begin(command)
            case PrepareCommand() if self.setup is not None:
                self._set(step=SetupStatus(step=command.step, **self.setup))
            case StopCommand():
                self._set(state="stopping")
            case PauseCommand():
                run = self.status.run.model_copy(update={"pause": "at checkpoint 10mm_1Hz_0.2V"})
                self._set(run=run)
            case AbortCommand():
                self._set(state="tripped", trip="aborted by a person")
            case ResetCommand():
                self._set(state="idle", trip="")

    def _answer(self, question):
        if isinstance(question, DescribeCommand):
            return Reply(ok=True, description=self.description)
        return Reply(ok=True, audit=self.trail.read_page(question) if self.trail else self.audit)

    def subscribe(self, stopping):
        while not stopping.is_set():
            try:
                yield self.published.get(timeout=0.01)
            except queue.Empty:
                yield None

    def publish(self, message=None):
        self.published.put(message or self._stamped_status())

    def _stamped_status(self):
        return self.status.model_copy(update={"utc_s": time.time(), "lease": self.lease.describe()})

    def progress(self, elapsed_s, segment):
        self._set(run=self.status.run.model_copy(update={"elapsed_s": elapsed_s, "segment": segment}))
        self.publish()

    def finish(self, outcome="clean", reason="", ending="completed"):
        ended = self.status.run.model_copy(update={"outcome": outcome, "reason": reason, "ending": ending})
        self._set(state="idle", run=ended, finished=(*self.status.finished, ended))
        self.publish()

    def forget(self):
        """Forget all runs, as a restarted agent does."""
        self.status = AgentStatus(state="idle")

    def _begin(self, command):
        number = len(self.status.finished) + 1
        run = RunStatus(
            id=f"{self.prefix}-{number}",
            method=command.method["name"],
            method_sha256=parse_method(command.method, "the command").compute_sha256(),
            specimen=command.specimen,
            continues=command.continues,
            operator=command.operator,
            log=command.log or f"/elsewhere/{self.prefix}-{number}.mcap",
            started=f"2026-03-0{number}T10:00:00+00:00",
            duration_s=23.1,
            calibration_overdue=self.overdue,
            failed_checks=self.failed_checks,
        )
        self._set(state="running", run=run)

    def _set(self, **changes):
        self.status = self.status.model_copy(update=changes)


class FakeEngine:
    """Keeps submitted jobs; the test reports their results on the service's event loop."""

    def __init__(self):
        self.listener = None
        self.specs = {}
        self.cancelled = []
        self.state = "ok"

    async def start(self, listener):
        self.listener = listener
        await listener.on_connected()

    async def submit(self, spec):
        self.specs[spec.job_id] = spec

    async def cancel(self, job_id, *, started):
        self.cancelled.append((job_id, started))

    async def release(self, job_id):
        """Nothing is followed, so that nothing is waited for."""

    async def describe_state(self):
        return self.state

    async def close(self):
        self.listener = None
