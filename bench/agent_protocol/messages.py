"""Replies and publications of the rig agent, as JSON except samples.

Each command is sent to the agent's request socket and is answered by one `Reply`. The publishing socket sends an
`AgentStatus` at every change and at least four times a second (topic ``status``), events (``event``), and all
bench samples in live batches (``samples``, see `bench.live`).
"""

from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

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
    paused_after: str = Field(
        default="", description="checkpoint at which a pause ended the run, so that it can be resumed; or empty"
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


class LeaseStatus(Message):
    """Client that holds the bench: nobody else starts a run or a setup step."""

    holder: str = Field(description="actor of its commands, such as `campaign:ID`")
    description: str = Field(description="the same for a person")
    until_utc_s: float = Field(description="UTC at which the lease ends unless it is renewed [s since 1970]")


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
    lease: LeaseStatus | None = Field(default=None, description="null while nobody holds the bench")
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
