"""What passes between the rig agent and those who use it: commands, answers, and what it publishes.

Everything is JSON. A command goes to the agent's request socket and is answered by one `Answer`; the agent's
other socket publishes `AgentStatus` at every change and at least four times a second (topic ``status``), bench
samples in batches (``samples``) and what happened (``event``).
"""

from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.agent.steps import Step

STATUS, SAMPLES, EVENT = b"status", b"samples", b"event"
"""Topics that the agent publishes."""

AgentState: TypeAlias = Literal["idle", "preparing", "running", "stopping", "tripped"]
"""tripped: a limit was exceeded or an instrument failed; everything is at rest, and stays there until a reset."""
RunOutcome: TypeAlias = Literal["clean", "lossy", "incomplete"]


class Message(BaseModel):
    """Base of all of them: frozen, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class StatusCommand(Message):
    """Ask for the `AgentStatus`."""

    command: Literal["status"] = "status"


class RunCommand(Message):
    """Run a method; refused unless the agent is idle. Answered as soon as it is accepted."""

    command: Literal["run"] = "run"
    method: dict[str, Any] = Field(description="a document `mrbench.method/1`")
    specimen: str = Field(default="", description="the damper under test")
    operator: str = Field(default="", description="who runs it")
    resume_after: str = Field(
        default="", description="segment, a checkpoint of the method, after which an interrupted run goes on"
    )
    log: str | None = Field(
        default=None, description="file of the log; made from the run's id in the agent's folder"
    )


class StopCommand(Message):
    """End the run in good order: the motion fades out, the coil goes to zero. Harmless when nothing runs."""

    command: Literal["stop"] = "stop"


class ResetCommand(Message):
    """Take back a trip whose cause has gone; nothing moves."""

    command: Literal["reset"] = "reset"


class PrepareCommand(Message):
    """One step before a run; refused unless the agent is idle. Answered when it is done, or soon while it goes on.

    ``home`` and ``move`` move the rod, the first is refused with a specimen clamped; a stop ends both.
    """

    command: Literal["prepare"] = "prepare"
    step: Step = Field(
        description="home: seek the reference; move: go to `position_m`; mount, unmount: a specimen has been "
        "clamped, unclamped; centre: the rod stands at the specimen's middle; tare, clear-tare: the present force "
        "is zero, or no more"
    )
    position_m: float | None = Field(
        default=None,
        description="[m] from the specimen's middle, or from home before there is one; where `move` goes",
    )

    @model_validator(mode="after")
    def _place_of_a_move(self) -> Self:
        if self.step == "move" and self.position_m is None:
            raise ValueError("move needs position_m; nothing was done")
        return self


class ShutDownCommand(Message):
    """Bring everything to rest and end the agent."""

    command: Literal["shut_down"] = "shut_down"


Command: TypeAlias = Annotated[
    StatusCommand | RunCommand | StopCommand | ResetCommand | PrepareCommand | ShutDownCommand,
    Field(discriminator="command"),
]


class RunStatus(Message):
    """A run that goes on, or that has ended."""

    id: str
    method: str = Field(description="its name")
    specimen: str
    operator: str
    log: str = Field(description="file of the log on the agent's machine")
    started: str = Field(description="UTC, ISO 8601")
    duration_s: float = Field(description="[s] as planned")
    elapsed_s: float = Field(default=0.0, description="[s] of the plan that are done")
    segment: str = Field(default="", description="name of the segment that runs, empty between segments")
    outcome: RunOutcome | None = Field(default=None, description="null while it goes on")
    reason: str = Field(default="", description="why it is not clean, in words")
    lost: dict[str, int] = Field(default_factory=dict, description="samples lost by channel")


class StepStatus(Message):
    """A step before a run that goes on, or that has ended."""

    step: Step
    outcome: Literal["going", "done", "failed"]
    words: str = Field(description="what is so now, or why it failed")


class InstrumentStatus(Message):
    """One instrument and its wire."""

    name: str
    driver: str
    address: str
    connected: bool
    received: int = Field(description="frames or replies taken")
    lost: int = Field(description="samples that were made and never came")
    corrupted: int = Field(description="frames that were thrown away")
    resynchronised: int = Field(description="times that the stream had to be found again")
    age_s: float | None = Field(description="[s] since its last good frame")
    skew_s: float | None = Field(
        description="[s] 95 % bound of what the mapping of its clock leaves; null without clock"
    )
    words: str = Field(description="what is wrong; empty where all is well")


class AgentStatus(Message):
    """All that the agent says of itself."""

    state: AgentState
    trip: str = Field(default="", description="why it tripped")
    mounting: str = Field(default="", description="unmounted, homed, mounted, centred or stranded")
    step: StepStatus | None = Field(default=None, description="the last step before a run; null before the first")
    run: RunStatus | None = Field(default=None, description="the run that goes on, or the last one")
    finished: tuple[RunStatus, ...] = Field(
        default=(), description="runs that ended since the agent started, newest last"
    )
    instruments: tuple[InstrumentStatus, ...] = ()
    warnings: tuple[str, ...] = Field(default=(), description="such as: no real-time priority, and why")
    drive_kind: str = Field(default="", description="coil_v or coil_a")
    drive_unit: str = Field(default="", description="V or A")


class Samples(Message):
    """Bench samples that came together, for live views: each list one value a sample, SI."""

    time_ns: list[int] = Field(description="bench clock")
    values: dict[str, list[float | None]] = Field(
        description="by field of `/bench/sample`; null where there is none"
    )
    segment: str = Field(default="", description="of the newest of them; empty between segments")


class AgentEvent(Message):
    """Something that happened."""

    time_ns: int
    kind: str = Field(description="state, command, alarm, trip, late, checkpoint, run_finished")
    text: str


class Answer(Message):
    """What comes back for a command."""

    ok: bool
    error: str = Field(default="", description="what failed, the value and the limit, what to do")
    status: AgentStatus | None = None
