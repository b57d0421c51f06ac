"""State of a campaign: everything that a process needs to continue it, as one document.

It is stored in the catalogue before and after each step. Times are UTC in seconds; on the simulated plant they are
those of the simulated clock.
"""

from typing import Any, Literal, TypeAlias

from pydantic import Field

from bench.campaigns.document import AnyStep, Campaign
from bench.validation import FrozenModel

CampaignStatus: TypeAlias = Literal["running", "pausing", "paused", "stopping", "done", "stopped"]
ENDED: tuple[CampaignStatus, ...] = ("done", "stopped")
"""Statuses of a campaign that does not continue."""
ItemState: TypeAlias = Literal["pending", "active", "done", "skipped", "failed", "held_back"]
Phase: TypeAlias = Literal["starting", "stroking", "preparing", "evaluating", "resting", "asking"]
"""starting: a run or setup step is about to be requested; preparing: a setup step is in progress; evaluating: the
results of a run are awaited; asking: a person is."""
MessageKind: TypeAlias = Literal["note", "restore_point", "edit", "person_needed", "held_back", "failed", "ended"]


class ParameterResult(FrozenModel):
    """Identified parameter."""

    value: float
    low: float | None = None
    """Lower end of the 95 % interval; None without one."""
    high: float | None = None
    unit: str = ""


class RunResult(FrozenModel):
    """Results of a run as far as conditions, trends and report need them."""

    parameters: dict[str, ParameterResult] = Field(default_factory=dict)
    rmse_n: float | None = None
    noise_floor_n: float | None = None
    verdict: str = ""
    effects: tuple[str, ...] = ()
    next_stroke: dict[str, Any] | None = None
    """Segment that the diagnosis proposes."""
    is_diagnosed: bool = False
    failure: str = ""
    """Reason why there is no result."""


class Item(FrozenModel):
    """Step of the queue with its history."""

    id: str
    step: AnyStep
    label: str
    expected_s: float = 0.0
    state: ItemState = "pending"
    executions: int = 0
    """Number of runs that were requested; part of the names of their logs."""
    failures: int = 0
    crashes: int = 0
    """Number of times that the bench ended in the middle of this step."""
    strokes: tuple[dict[str, Any], ...] = ()
    """Segments that diagnoses have proposed for this step."""
    runs: tuple[str, ...] = ()
    """Ids of the complete runs."""
    parts: tuple[str, ...] = ()
    """Ids of the incomplete runs, each continued or repeated by a later one."""
    resume_after: str = ""
    """Checkpoint after which the next run of this step begins."""
    continues: str = ""
    """Id of the incomplete run that the next one continues or repeats."""
    reason: str = ""
    note: str = ""
    """Answer of the operator."""
    photo: str = ""
    """File of the operator's photo."""
    is_during_pause: bool = False
    """True for one step that is to be done now although the campaign is paused."""
    started: float | None = None
    ended: float | None = None


class Execution(FrozenModel):
    """One requested run."""

    log: str
    """File name of its log, unique in the data folder."""
    resume_after: str = ""
    continues: str = ""


class Active(FrozenModel):
    """Step that is in progress."""

    item: str
    phase: Phase
    since: float
    execution: Execution | None = None
    """Run of this step; None for a step without a run, such as a setup step."""
    deadline: float | None = None
    is_question: bool = False
    """True if a person decides on a failure: retry, skip or stop."""
    started: float = 0.0
    """Begin of the whole step, for its time limit."""


class Times(FrozenModel):
    """Times [s] of a campaign by what they were spent on."""

    stroking_s: float = 0.0
    held_s: float = 0.0
    """Paused, waiting for a person, for results or for the bench, in setup steps, and while no process ran."""
    rest_s: float = 0.0


class RunFact(FrozenModel):
    """A complete run of the campaign."""

    run: str
    item: str
    specimen: str
    method: str
    drive: float | None = None
    ended: float
    duration_s: float
    outcome: str
    temperature_c: float | None = None
    """Reading of the thermometer at the end of the run; None without one, and in campaigns of older versions."""


class Message(FrozenModel):
    """Event of a campaign for persons and the record."""

    at: float
    kind: MessageKind
    text: str
    who: str = ""
    item: str = ""


class CampaignState(FrozenModel):
    """State of a campaign."""

    campaign: Campaign
    items: tuple[Item, ...]
    status: CampaignStatus = "running"
    reason: str = ""
    """Reason of the status, for a person."""
    active: Active | None = None
    times: Times = Times()
    updated: float
    """UTC [s] of the latest change."""
    started: float
    operator: str = ""
    temperature_c: float | None = None
    """Latest reading of the thermometer."""
    waits_for: str = ""
    """Reason why the bench cannot start the next step; empty if it can."""
    awaited_run: str = ""
    """Run whose results a condition of ``stop_on`` needs before the next step; empty without one."""
    waits_since: float | None = None
    """Time since which the bench cannot start it."""
    is_wait_told: bool = False
    """True if a person was told of it."""
    facts: tuple[RunFact, ...] = ()
    """Complete runs, oldest first."""
    results: dict[str, RunResult] = Field(default_factory=dict)
    numbered: int = 0
    """Number of items that were ever made; gives each its id."""
    outbox: tuple[Message, ...] = Field(default=(), exclude=True)
    """Messages of the present change; the store records and removes them."""

    def get_item(self, item_id: str) -> Item:
        """Return an item that is known to exist."""
        return next(item for item in self.items if item.id == item_id)

    @property
    def pending(self) -> tuple[Item, ...]:
        """Items that have not begun, in order."""
        return tuple(item for item in self.items if item.state == "pending")

    @property
    def has_ended(self) -> bool:
        """Return whether the campaign does not continue."""
        return self.status in ENDED

    @property
    def is_stroking(self) -> bool:
        """Return whether a run is in progress or about to begin."""
        return self.is_executing and self.active is not None and self.active.execution is not None

    @property
    def is_executing(self) -> bool:
        """Return whether a run or a setup step is in progress or about to begin."""
        return self.active is not None and self.active.phase in ("starting", "stroking", "preparing")

    @property
    def next_item(self) -> Item | None:
        """Item that begins next; during a pause only one that is to be done although the campaign is paused."""
        is_paused = self.status == "paused"
        return next((item for item in self.pending if item.is_during_pause or not is_paused), None)

    @property
    def is_held(self) -> bool:
        """Return whether a pause holds the campaign, with no step to do during the pause."""
        if self.status != "paused":
            return False
        if self.active is not None:
            return not self.get_item(self.active.item).is_during_pause
        return self.next_item is None

    @property
    def needs_lease(self) -> bool:
        """Return whether nobody else may start something; while the campaign waits for a person, others may."""
        is_free = self.has_ended or self.is_held or self.needs_person or bool(self.waits_for)
        return not is_free

    @property
    def needs_person(self) -> bool:
        """Return whether the campaign waits for an answer."""
        return self.active is not None and self.active.phase == "asking" and not self.has_ended
