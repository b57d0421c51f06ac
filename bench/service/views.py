"""What the REST interface answers: frozen types, units in every field's description."""

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.agent_protocol import AgentStatus
from bench.catalogue import JobRow, JobState, RunOutcome, RunRow, RunState
from bench.methods import DriveKind
from bench.setup_steps import SetupStep


class View(BaseModel):
    """Ground of all of them."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Health(View):
    """Whether everything is there."""

    version: str
    agent: str = Field(description="`ok`, or what is missing")
    worker: str = Field(description="`ok`, or what is missing")


class SetupRequest(View):
    """A step before a run."""

    step: SetupStep = Field(description="home, move, mount, centre, unmount, tare or clear-tare")
    position_m: float | None = Field(
        default=None, description="[m] where `move` goes, from the middle or from home; no other step needs it"
    )

    @model_validator(mode="after")
    def _check_move_position(self) -> Self:
        if self.step == "move" and self.position_m is None:
            raise ValueError("move needs position_m; nothing was done")
        return self


class MethodSummary(View):
    """A method that ships with the product."""

    name: str
    title: str
    duration_s: float = Field(description="[s] with its conditioning, fades and moves")
    drive_kind: DriveKind = Field(description="what commands the damper")


class RunProgress(View):
    """How far a run is."""

    elapsed_s: float = Field(description="[s] of the plan that are done")
    duration_s: float = Field(description="[s] of the plan")
    segment: str = Field(description="what runs; empty between segments")


class Job(View):
    """One piece of work on a run."""

    id: str
    run: str = Field(description="id of the run")
    kind: str = Field(description="`identify`")
    state: JobState
    activity: str = Field(description="what it says of itself while it runs")
    attempts: int = Field(description="times that a worker began")
    error: str = Field(description="why it has failed")
    settings: dict[str, Any] = Field(description="as asked")
    created: datetime = Field(description="UTC")
    started: datetime | None = Field(description="UTC, last time that a worker began")
    finished: datetime | None = Field(description="UTC")
    rmse_n: float | None = Field(description="[N] force error on the samples fitted; null until done")
    noise_floor_n: float | None = Field(description="[N] noise of the recorded force; null until done")
    result: str = Field(description="`converged`, or why not; empty until done")


class Run(View):
    """One run and what was made of it."""

    id: str
    method: str
    specimen: str
    operator: str
    source: str = Field(description="`run`, or `import` for a recording made elsewhere")
    started: datetime = Field(description="UTC; of an import that does not say, when its log was written")
    duration_s: float | None = Field(
        description="recorded time [s]; planned time while it runs; null for a truncated log"
    )
    state: RunState = Field(
        description="truncated: the log has no end and is no longer being written; repair it with `salvage`"
    )
    outcome: RunOutcome | None = Field(description="null until it has ended")
    reason: str = Field(description="why the outcome is not clean")
    log: str = Field(description="the log's file, from the data folder or absolute")
    progress: RunProgress | None = Field(description="while it runs")
    rmse_n: float | None = Field(description="[N] force error of the newest fit; null without fit")
    noise_floor_n: float | None = Field(description="[N] noise of the recorded force; null without fit")
    result: str = Field(description="of the newest fit: `converged`, or why not; empty without fit")
    jobs: tuple[Job, ...] = Field(description="oldest first")


class RunPage(View):
    """Some runs, newest first."""

    items: tuple[Run, ...]
    next: str | None = Field(description="what to give as `before` for the next page; null on the last one")


class JobList(View):
    """Jobs, newest first."""

    items: tuple[Job, ...]


class StartRunRequest(View):
    """A run that is wanted."""

    method: str | dict[str, Any] = Field(description="name of a shipped method, or a document `mrbench.method/1`")
    specimen: str = Field(default="", max_length=200, description="the damper under test, with its serial number")
    operator: str = Field(default="", max_length=200, description="who runs it")
    resume_after: str = Field(
        default="", description="segment after which an interrupted run goes on, a checkpoint of the method"
    )


def make_job_view(row: JobRow) -> Job:
    """A job as it is shown."""
    summary = row.summary or {}
    return Job(
        id=row.id,
        run=row.run_id,
        kind=row.kind,
        state=row.state,
        activity=row.activity,
        attempts=row.attempts,
        error=row.error,
        settings=row.settings,
        created=row.created,
        started=row.started,
        finished=row.finished,
        rmse_n=summary.get("rmse_n"),
        noise_floor_n=summary.get("noise_floor_n"),
        result=summary.get("result", ""),
    )


def make_run_view(row: RunRow, jobs: list[JobRow], status: AgentStatus | None) -> Run:
    """A run as it is shown.

    Args:
        row: the run.
        jobs: its jobs, newest first.
        status: of the agent, for the progress; none where it is not known.
    """
    shown = [make_job_view(job) for job in jobs]
    fit = next((job for job in shown if job.state == "done"), None)
    return Run(
        id=row.id,
        method=row.method,
        specimen=row.specimen,
        operator=row.operator,
        source=row.source,
        started=row.started,
        duration_s=row.duration_s,
        state=row.state,
        outcome=row.outcome,
        reason=row.reason,
        log=row.log,
        progress=_find_progress(row, status),
        rmse_n=fit.rmse_n if fit else None,
        noise_floor_n=fit.noise_floor_n if fit else None,
        result=fit.result if fit else "",
        jobs=tuple(reversed(shown)),
    )


def _find_progress(row: RunRow, status: AgentStatus | None) -> RunProgress | None:
    run = status.run if status else None
    if row.state != "running" or run is None or run.id != row.id:
        return None
    return RunProgress(elapsed_s=run.elapsed_s, duration_s=run.duration_s, segment=run.segment)
