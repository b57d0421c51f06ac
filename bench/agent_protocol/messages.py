"""Messages between the rig agent and its clients: commands, replies and publications, as JSON except samples.

Each command is sent to the agent's request socket and is answered by one `Reply`. The publishing socket sends an
`AgentStatus` at every change and at least four times a second (topic ``status``), events (``event``), and all
bench samples in live batches (``samples``, see `bench.live`).
"""

from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.calibration import IssuedCertificate, LatestCheck
from bench.endings import RunEnding
from bench.setup_steps import SetupStep

STATUS, SAMPLES, EVENT = b"status", b"samples", b"event"
"""Topics that the agent publishes."""

AgentState: TypeAlias = Literal["idle", "preparing", "running", "stopping", "tripped"]
"""tripped: a limit was exceeded or an instrument failed; everything is at rest and stays so until a reset."""
RunOutcome: TypeAlias = Literal["clean", "lossy", "incomplete"]
SetupOutcome: TypeAlias = Literal["running", "done", "failed"]


class Message(BaseModel):
    """Base class of all messages: frozen, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Sender(Message):
    """Person or program on whose behalf a command is sent, for the audit trail of the agent."""

    actor: str = Field(max_length=300, description="`user:NAME`, `local:ACCOUNT`, `campaign:ID`, `service`, ...")
    origin: str = Field(default="local", max_length=300, description="address of the client, or `local`")
    request: str = Field(default="", max_length=100, description="id of the request to the service; empty without")


class SentCommand(Message):
    """Command that is recorded in the audit trail."""

    sender: Sender | None = Field(default=None, description="null from a client of an older version")


class TimedCommand(SentCommand):
    """Command that begins something, clears a trip or ends the agent: refused when its sender no longer waits.

    A command may lie in the queue of an agent that is suspended or starts. Executed later, it would move the rod
    although its sender was told that no agent replied. A stop, an abort and a pause act whenever they arrive.
    """

    valid_until_utc_s: float | None = Field(
        default=None, description="UTC until which it may be executed [s since 1970]; null for any time"
    )


class StatusCommand(Message):
    """Request of the `AgentStatus`."""

    command: Literal["status"] = "status"


class DescribeCommand(Message):
    """Request of the `BenchDescription`, which stays the same while the agent runs."""

    command: Literal["describe"] = "describe"


class RunCommand(TimedCommand):
    """Start of a run; refused unless the agent is idle. The reply comes as soon as the run is accepted."""

    command: Literal["run"] = "run"
    method: dict[str, Any] = Field(description="a document `mrbench.method/1`")
    specimen: str = Field(default="", description="the damper under test")
    operator: str = Field(default="", description="name of the operator")
    resume_after: str = Field(
        default="", description="checkpoint of the method (segment) after which an interrupted run continues"
    )
    continues: str = Field(default="", description="id of the run that this one continues; empty without one")
    certificates: tuple[IssuedCertificate, ...] = Field(
        default=(), description="calibration certificates that apply to the channels; empty if none are known"
    )
    checks: tuple[LatestCheck, ...] = Field(
        default=(), description="latest check of each channel; empty if none are known"
    )
    log: str | None = Field(
        default=None, description="file of the log; by default named by the run's id, in the agent's folder"
    )


class StopCommand(SentCommand):
    """Controlled stop of the run: the motion fades out, the coil goes to zero. Harmless without a run."""

    command: Literal["stop"] = "stop"


class PauseCommand(SentCommand):
    """End of the run at its next checkpoint, at rest. Without a later checkpoint the run is played to its end."""

    command: Literal["pause"] = "pause"


class AbortCommand(SentCommand):
    """Trip by a person: coil and actuator are stopped at once, each in its fastest way.

    It latches until a reset, also while nothing moves. Needs no lease.
    """

    command: Literal["abort"] = "abort"


class ResetCommand(TimedCommand):
    """Reset of a trip whose cause is removed; nothing moves."""

    command: Literal["reset"] = "reset"


class PrepareCommand(TimedCommand):
    """Start of a setup step; refused unless the agent is idle.

    The reply comes when the step is done, or soon while it continues. ``home`` and ``move`` move the rod, and a
    stop ends both; ``home`` is refused with a specimen clamped.
    """

    command: Literal["prepare"] = "prepare"
    step: SetupStep = Field(
        description="home: seek the reference; move: go to `position_m`; mount, unmount: a specimen has been "
        "clamped, unclamped; centre: the rod is at the specimen's middle; tare, clear-tare: take the present "
        "force as zero, or no longer"
    )
    position_m: float | None = Field(
        default=None,
        description="target of `move` [m], from the specimen's middle, or from home before one is centred",
    )

    @model_validator(mode="after")
    def _check_move_position(self) -> Self:
        if self.step == "move" and self.position_m is None:
            raise ValueError("move needs position_m; nothing was done")
        return self


class ShutDownCommand(TimedCommand):
    """End of the agent, with everything at rest."""

    command: Literal["shut_down"] = "shut_down"


class AuditCommand(Message):
    """Request of entries of the agent's own audit trail."""

    command: Literal["audit"] = "audit"
    chain: str = Field(
        default="", description="id of the chain that the client knows; with another one, no entries"
    )
    after: int = Field(default=0, ge=0, description="number of the last entry that the client has")


Command: TypeAlias = Annotated[
    StatusCommand
    | AuditCommand
    | DescribeCommand
    | RunCommand
    | StopCommand
    | PauseCommand
    | AbortCommand
    | ResetCommand
    | PrepareCommand
    | ShutDownCommand,
    Field(discriminator="command"),
]


class RunStatus(Message):
    """State of a run in progress, or result of a finished one."""

    id: str
    method: str = Field(description="name of the method")
    method_sha256: str = Field(default="", description="hash of the content of the method")
    specimen: str
    operator: str
    log: str = Field(description="file of the log on the agent's machine")
    started: str = Field(description="UTC, ISO 8601")
    duration_s: float = Field(description="planned duration [s]")
    elapsed_s: float = Field(default=0.0, description="completed time of the plan [s]")
    segment: str = Field(default="", description="name of the current segment; empty between segments")
    cycle: int | None = Field(default=None, description="cycle of the segment, from 1; null without cycles")
    cycles: int | None = Field(default=None, description="number of cycles of the segment; null without cycles")
    outcome: RunOutcome | None = Field(default=None, description="null while the run is in progress")
    ending: RunEnding | None = Field(
        default=None,
        description="completed, stopped (controlled, on request), aborted (at once, by a person) or tripped (by "
        "the bench itself); null while the run is in progress",
    )
    reason: str = Field(default="", description="reason why the outcome is not clean, for a person")
    continues: str = Field(default="", description="id of the run that this one continues; empty without one")
    calibration_overdue: tuple[str, ...] = Field(
        default=(), description="channels whose calibration was overdue at the start of the run, in words"
    )
    failed_checks: tuple[str, ...] = Field(
        default=(), description="channels whose latest check had failed at the start of the run, in words"
    )
    pause: str = Field(
        default="", description="when a requested pause takes effect, for a person; empty without a request"
    )
    lost: dict[str, int] = Field(default_factory=dict, description="number of lost samples by channel")


class SetupStatus(Message):
    """State of a setup step in progress, or result of a finished one."""

    step: SetupStep
    outcome: SetupOutcome
    message: str = Field(description="present state of the rod, or reason of the failure, for a person")


class InstrumentStatus(Message):
    """State of one instrument and its wire."""

    name: str
    driver: str
    address: str
    connected: bool
    received: int = Field(description="number of received frames or replies")
    lost: int = Field(description="number of samples that were taken and never received")
    corrupted: int = Field(description="number of discarded frames")
    resynchronised: int = Field(description="number of times that the start of a frame was searched for")
    age_s: float | None = Field(description="time since the last valid frame [s]")
    clock_error_bound_s: float | None = Field(
        description="95 % bound of the error of the clock map [s]; null without a clock"
    )
    message: str = Field(description="fault for a person; empty without a fault")


class LimitStatus(Message):
    """One limit in force, for either sign of its quantity."""

    quantity: str = Field(description="force, displacement (of the rod), actuator_velocity, temperature, ...")
    action: str = Field(description="what follows: indicate, hold, controlled_stop or trip")
    value: float = Field(description="in the SI unit of the quantity; temperature in degC")


class AgentStatus(Message):
    """State of the agent."""

    state: AgentState
    utc_s: float = Field(
        default=0.0,
        description="UTC at which the agent made this status [s since 1970]; a status is true at this moment only",
    )
    trip: str = Field(default="", description="reason of the trip; empty without a trip")
    reference_state: str = Field(default="", description="unreferenced, homed, mounted, centred or reference_lost")
    step: SetupStatus | None = Field(default=None, description="the latest setup step; null before the first")
    run: RunStatus | None = Field(default=None, description="the run in progress, or the latest one")
    finished: tuple[RunStatus, ...] = Field(
        default=(), description="runs that finished since the agent started, newest last"
    )
    instruments: tuple[InstrumentStatus, ...] = ()
    warnings: tuple[str, ...] = Field(default=(), description="such as: no real-time priority, with the reason")
    limits: tuple[LimitStatus, ...] = Field(default=(), description="limits in force at present")
    travel_m: tuple[float, float] | None = Field(
        default=None, description="positions of both end stops of the rod [m]; null if not known"
    )
    drive_kind: str = Field(default="", description="coil_v or coil_a")
    drive_unit: str = Field(default="", description="V or A")
    config_identity: str = Field(default="", description="differs for another content of bench.toml")
    notice: str = Field(
        default="", description="what a person has to do so that the agent has the present bench.toml; else empty"
    )


class AgentEvent(Message):
    """Event of the agent or of a run."""

    time_ns: int
    kind: str = Field(description="state, command, alarm, trip, late, checkpoint, check, run_finished")
    text: str


class BenchLimit(Message):
    """Values of one quantity beyond which the bench acts, for either sign; null for no action."""

    unit: str
    indicate: float | None = Field(description="alarm; the run continues")
    hold: float | None = Field(description="the motion fades out and the rod is held")
    controlled_stop: float | None = Field(description="the motion fades out, the run ends")
    trip: float | None = Field(description="coil and actuator are stopped at once; latches")


class BenchChannel(Message):
    """One recorded channel."""

    unit: str
    rate_hz: float = Field(description="[Hz] sampling rate of the instrument")
    delay_s: float = Field(description="[s] delay of the channel behind the measured quantity")


class BenchDescription(Message):
    """Description of the bench in its configuration."""

    name: str
    specimen: str = Field(description="mounted damper, used if a run does not name one; empty without one")
    drive_kind: str = Field(description="coil_v or coil_a")
    drive_unit: str = Field(description="V or A")
    limits: dict[str, BenchLimit] = Field(description="limits of the fixture by quantity")
    channels: dict[str, BenchChannel] = Field(description="recorded channels; `coil_drive` repeats a measured one")


class AuditPage(Message):
    """Part of the agent's audit trail."""

    chain: str = Field(description="id of the chain; empty before its first entry")
    before: str = Field(description="`sha256` of the entry `after`; empty if there is no such entry")
    lines: tuple[str, ...] = Field(description="the entries that follow it, each as its line in the file")


class Reply(Message):
    """Reply to a command."""

    ok: bool
    error: str = Field(default="", description="what failed, the value and the limit, what to do")
    status: AgentStatus | None = None
    description: BenchDescription | None = Field(default=None, description="only in the reply to `describe`")
    audit: AuditPage | None = Field(default=None, description="only in the reply to `audit`")
