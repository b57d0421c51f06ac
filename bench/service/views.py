"""Request and response models of the REST interface, frozen, with units in the descriptions."""

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any, Self, TypeAlias

from fastapi import Query
from pydantic import BaseModel, ConfigDict, Field, model_validator

from bench.agent_protocol import AgentEvent, AgentStatus
from bench.catalogue import JobRow, LogIntegrity, RunOutcome, RunRow, RunState
from bench.endings import RunEnding
from bench.jobs import DiagnosisSummary, Job, find_newest_done, make_diagnosis_summary, make_job_view
from bench.setup_steps import SetupStep
from bench.validation import SerialNumber


class View(BaseModel):
    """Base class of all models: frozen, unknown fields refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


BenchName: TypeAlias = Annotated[str, Field(max_length=100)]
"""Name of a bench in a request; whether there is such a bench is checked by the route."""


BenchChoice: TypeAlias = Annotated[
    str | None, Query(max_length=100, description="name of the bench; needed if there are several")
]
"""Name of a bench in the query of a request."""


class Health(View):
    """State of agent, worker, disk, queue, campaigns, audit trail, clocks and log store, each in words."""

    version: str
    agent: str = Field(description="`ok`, or the reason why it is not available; with several benches by bench")
    benches: dict[str, str] = Field(
        description="by bench: `ok`, or the reason why its rig agent is not available, or of its trip"
    )
    worker: str = Field(description="`ok`, or the reason why it is not available")
    disk: str = Field(description="`ok`, or the free space of the data folder where it is little")
    queue: str = Field(description="`empty`, or the numbers of running and waiting jobs")
    campaigns: str = Field(description="`ok`, or the campaigns whose bench this service does not have")
    audit: str = Field(description="`ok`, or why the audit trail cannot be written, or that it was altered")
    clocks: str = Field(description="`ok`, or the instruments whose clock has an error above 1 ms, with its bound")
    calibration: str = Field(
        description="`ok`, or the channels whose calibration is overdue or due within 14 days, with the date, or "
        "whose latest check is out of control"
    )
    log_store: str = Field(
        description="`ok`, `not used`, or the number of logs that wait for their copy, and why the store fails"
    )


class LiveEvent(AgentEvent):
    """Event of an agent on the websocket, with its number in the catalogue.

    By the number a client recognises it among the stored events.
    """

    id: int | None = Field(description="number of the stored event; null if it could not be stored")
    run: str | None = Field(description="id of the run in progress; null outside runs")
    bench: str = Field(description="name of the bench")
    at: datetime = Field(description="UTC")


class SetupRequest(View):
    """Request of a setup step."""

    step: SetupStep = Field(description="home, move, mount, centre, unmount, tare or clear-tare")
    position_m: float | None = Field(
        default=None,
        strict=True,  # true and "1" are no positions
        description="target of `move` [m], from the specimen's middle, or from home; unused by other steps",
    )

    @model_validator(mode="after")
    def _check_move_position(self) -> Self:
        if self.step == "move" and self.position_m is None:
            raise ValueError("move needs position_m; nothing was done")
        return self


class RunProgress(View):
    """Progress of a run."""

    elapsed_s: float = Field(description="completed time of the plan [s]")
    duration_s: float = Field(description="planned duration [s]")
    segment: str = Field(description="name of the current segment; empty between segments")


class Run(View):
    """One run with its jobs and the result of its newest fit."""

    id: str
    method: str
    method_version: int | None = Field(
        description="version of the method; null if its content was not stored under its name"
    )
    method_sha256: str | None = Field(
        description="hash of the content of the method; null in runs of older versions and in imports"
    )
    specimen: str
    operator: str
    bench: str | None = Field(
        description="name of the bench in the service; null in runs of older versions, in imports and in logs "
        "that were found later"
    )
    source: str = Field(description="`run`, or `import` for a recording made elsewhere")
    started: datetime = Field(description="UTC; time of the log file for an import without a start time")
    duration_s: float | None = Field(
        description="recorded time [s]; planned time while it runs; null for a truncated log"
    )
    state: RunState = Field(
        description="truncated: the log has no end and is no longer being written; repair it with `salvage`"
    )
    outcome: RunOutcome | None = Field(description="null while the run is in progress")
    ending: RunEnding | None = Field(
        description="completed, stopped (controlled, on request), aborted (at once, by a person) or tripped (by "
        "the bench itself); null while the run is in progress, and if it is not known"
    )
    reason: str = Field(description="reason why the outcome is not clean")
    continues: str | None = Field(description="id of the run that this one continues after a checkpoint")
    log: str = Field(description="file of the log, relative to the data folder or absolute")
    log_bytes: int | None = Field(description="size of the log [bytes]; null until it was read")
    lost: dict[str, int] = Field(description="number of lost samples by channel; empty if none was lost")
    alarms: tuple[str, ...] = Field(description="texts of the alarms during the run")
    calibration_overdue: tuple[str, ...] = Field(
        description="channels whose calibration was overdue at the start, each with its certificate and due date"
    )
    failed_checks: tuple[str, ...] = Field(
        description="channels whose latest check had failed at the start, in words with values"
    )
    tags: tuple[str, ...] = Field(description="words by which a person sorts runs")
    trashed: datetime | None = Field(description="UTC at which the run was moved to the trash; null outside it")
    log_sha256: str | None = Field(description="hash of the log as it was recorded; null without a complete log")
    integrity: LogIntegrity | None = Field(
        description="latest comparison of the log with its hash: intact, changed or missing; null before the first"
    )
    progress: RunProgress | None = Field(description="null unless the run is in progress")
    rmse_n: float | None = Field(description="force error of the newest fit [N]; null without a fit")
    noise_floor_n: float | None = Field(description="noise floor of the recorded force [N]; null without a fit")
    result: str = Field(
        description="result of the newest fit: `converged`, or the reason why not; empty without a fit"
    )
    diagnosis: DiagnosisSummary | None = Field(description="answer of the newest diagnosis; null without one")
    jobs: tuple[Job, ...] = Field(description="oldest first")


class Integrity(View):
    """Comparison of a log with the hash that was stored when it was recorded."""

    integrity: LogIntegrity | None = Field(
        description="intact, changed or missing; null before the first comparison"
    )
    recorded_sha256: str | None = Field(description="hash of the log as it was recorded; fits refer to it")
    found_sha256: str | None = Field(description="hash at the latest comparison; null if the log was missing")
    checked: datetime | None = Field(description="UTC of the latest comparison")
    copy_url: str | None = Field(description="address of the verified copy in the log store; null without one")
    copied: datetime | None = Field(description="UTC at which the copy was verified")
    removed: datetime | None = Field(
        description="UTC at which the log was removed from this machine; null while it is here"
    )


class RunPage(View):
    """One page of runs, newest first."""

    items: tuple[Run, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class StartRunRequest(View):
    """Request of a run."""

    method: str | dict[str, Any] = Field(description="name of a method, or a document `mrbench.method/1`")
    method_version: int | None = Field(
        default=None, ge=1, description="version of the named method; by default its newest one"
    )
    specimen: SerialNumber | None = Field(
        default=None,
        description="serial number of the damper, registered at its first use; by default that of bench.toml",
    )
    operator: str = Field(default="", max_length=200, description="name of the operator")
    bench: BenchName | None = Field(default=None, description="name of the bench; required if there are several")
    resume_after: str = Field(
        default="", description="checkpoint of the method (segment) after which an interrupted run continues"
    )


class ResumeRunRequest(View):
    """Request to continue a run."""

    after: str = Field(default="", description="checkpoint to continue after; by default the last one passed")


def make_run_view(row: RunRow, jobs: list[JobRow], *statuses: AgentStatus | None) -> Run:
    """Return the view of a run.

    Args:
        row: run in the catalogue.
        jobs: jobs of the run, newest first.
        statuses: statuses of the agents, for the progress; None for one that is not known.
    """
    newest_fit, newest_diagnosis = (find_newest_done(jobs, kind) for kind in ("identify", "diagnose"))
    fit = make_job_view(newest_fit) if newest_fit else None
    return Run(
        id=row.id,
        method=row.method,
        method_version=row.method_version,
        method_sha256=row.method_sha256,
        specimen=row.specimen,
        operator=row.operator,
        bench=row.bench,
        source=row.source,
        started=row.started,
        duration_s=row.duration_s,
        state=row.state,
        outcome=row.outcome,
        ending=row.ending,
        reason=row.reason,
        continues=row.continues,
        log=row.log,
        log_bytes=row.log_bytes,
        lost=row.lost or {},
        alarms=tuple(row.alarms or ()),
        calibration_overdue=tuple(row.calibration_overdue or ()),
        failed_checks=tuple(row.failed_checks or ()),
        tags=tuple(row.tags or ()),
        trashed=row.trashed,
        log_sha256=row.log_sha256,
        integrity=row.integrity,
        progress=_find_progress(row, statuses),
        rmse_n=fit.rmse_n if fit else None,
        noise_floor_n=fit.noise_floor_n if fit else None,
        result=fit.result if fit else "",
        diagnosis=make_diagnosis_summary(newest_diagnosis) if newest_diagnosis else None,
        jobs=tuple(make_job_view(job) for job in reversed(jobs)),
    )


def _find_progress(row: RunRow, statuses: Iterable[AgentStatus | None]) -> RunProgress | None:
    runs = (status.run for status in statuses if status is not None)
    run = next((run for run in runs if run is not None and run.id == row.id), None)
    if row.state != "running" or run is None:
        return None
    return RunProgress(elapsed_s=run.elapsed_s, duration_s=run.duration_s, segment=run.segment)
