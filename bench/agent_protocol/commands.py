"""Commands to the rig agent, each answered by one `Reply`."""

from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from bench.agent_protocol.messages import Message
from bench.calibration import IssuedCertificate, LatestCheck
from bench.setup_steps import SetupStep


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


class LeaseCommand(SentCommand):
    """Lease of the bench for its sender, such as a campaign: meanwhile nobody else starts a run or a setup step.

    The holder repeats it before the time ends. A stop, an abort, a pause and a reset need no lease.
    """

    command: Literal["lease"] = "lease"
    description: str = Field(max_length=300, description="holder for a person, such as `campaign X of Anna`")
    duration_s: float = Field(ge=0, le=60, description="time until the lease ends [s]; 0 gives the bench back")


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
    | LeaseCommand
    | ShutDownCommand,
    Field(discriminator="command"),
]
