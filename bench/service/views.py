"""Request and response models of the REST interface, frozen, with units in the descriptions."""

from datetime import datetime
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.agent_protocol import AgentStatus
from bench.catalogue import JobRow, JobState, RunOutcome, RunRow, RunState
from bench.methods import DriveKind
from bench.setup_steps import SetupStep


class View(BaseModel):
    """Base class of all models: frozen, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Health(View):
    """Availability of agent and worker."""

    version: str
    agent: str = Field(description="`ok`, or the reason why it is not available")
    worker: str = Field(description="`ok`, or the reason why it is not available")


class SetupRequest(View):
    """Request of a setup step."""

    step: SetupStep = Field(description="home, move, mount, centre, unmount, tare or clear-tare")
    position_m: float | None = Field(
        default=None,
        description="target of `move` [m], from the specimen's middle, or from home; unused by other steps",
    )

    @model_validator(mode="after")
    def _check_move_position(self) -> Self:
        if self.step == "move" and self.position_m is None:
            raise ValueError("move needs position_m; nothing was done")
        return self


class MethodSummary(View):
    """Summary of a method that is part of mrbench."""

    name: str
    title: str
    duration_s: float = Field(description="duration with conditioning, fades and moves [s]")
    drive_kind: DriveKind = Field(description="quantity that drives the damper")


class RunProgress(View):
    """Progress of a run."""

    elapsed_s: float = Field(description="completed time of the plan [s]")
    duration_s: float = Field(description="planned duration [s]")
    segment: str = Field(description="name of the current segment; empty between segments")


class Job(View):
    """One identification of a run."""

    id: str
    run: str = Field(description="id of the run")
    kind: str = Field(description="`identify`")
    state: JobState
    activity: str = Field(description="present activity of a running job")
    attempts: int = Field(description="number of starts by a worker")
    error: str = Field(description="reason of the failure")
    settings: dict[str, Any] = Field(description="requested settings")
    created: datetime = Field(description="UTC")
    started: datetime | None = Field(description="UTC of the last start by a worker")
    finished: datetime | None = Field(description="UTC")
    rmse_n: float | None = Field(description="force error on the fitted samples [N]; null until done")
    noise_floor_n: float | None = Field(description="noise floor of the recorded force [N]; null until done")
    result: str = Field(description="`converged`, or the reason why not; empty until done")


class Run(View):
    """One run with its jobs and the result of its newest fit."""

    id: str
    method: str
    specimen: str
    operator: str
    source: str = Field(description="`run`, or `import` for a recording made elsewhere")
    started: datetime = Field(description="UTC; time of the log file for an import without a start time")
    duration_s: float | None = Field(
        description="recorded time [s]; planned time while it runs; null for a truncated log"
    )
    state: RunState = Field(
        description="truncated: the log has no end and is no longer being written; repair it with `salvage`"
    )
    outcome: RunOutcome | None = Field(description="null while the run is in progress")
    reason: str = Field(description="reason why the outcome is not clean")
    log: str = Field(description="file of the log, relative to the data folder or absolute")
    progress: RunProgress | None = Field(description="null unless the run is in progress")
    rmse_n: float | None = Field(description="force error of the newest fit [N]; null without a fit")
    noise_floor_n: float | None = Field(description="noise floor of the recorded force [N]; null without a fit")
    result: str = Field(
        description="result of the newest fit: `converged`, or the reason why not; empty without a fit"
    )
    jobs: tuple[Job, ...] = Field(description="oldest first")


class RunPage(View):
    """One page of runs, newest first."""

    items: tuple[Run, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class JobList(View):
    """List of jobs, newest first."""

    items: tuple[Job, ...]


class StartRunRequest(View):
    """Request of a run."""

    method: str | dict[str, Any] = Field(
        description="name of an included method, or a document `mrbench.method/1`"
    )
    specimen: str = Field(default="", max_length=200, description="damper under test, with its serial number")
    operator: str = Field(default="", max_length=200, description="name of the operator")
    resume_after: str = Field(
        default="", description="checkpoint of the method (segment) after which an interrupted run continues"
    )


def make_job_view(row: JobRow) -> Job:
    """Return the view of a job."""
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
    """Return the view of a run.

    Args:
        row: run in the catalogue.
        jobs: jobs of the run, newest first.
        status: status of the agent, for the progress; None if it is not known.
    """
    job_views = [make_job_view(job) for job in jobs]
    fit = next((job for job in job_views if job.state == "done"), None)
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
        jobs=tuple(reversed(job_views)),
    )


def _find_progress(row: RunRow, status: AgentStatus | None) -> RunProgress | None:
    run = status.run if status else None
    if row.state != "running" or run is None or run.id != row.id:
        return None
    return RunProgress(elapsed_s=run.elapsed_s, duration_s=run.duration_s, segment=run.segment)
