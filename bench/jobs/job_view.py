"""Jobs as programs see them: responses and requests of the REST interface."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from pydantic import Field

from bench.catalogue import JobRow, JobState
from bench.jobs.settings import AnalysisKind, JobKind
from bench.validation import FrozenModel


class DiagnosisSummary(FrozenModel):
    """Answer of a diagnosis in short."""

    id: str = Field(description="id of the diagnosis: `/diagnoses/{id}`, `/twins/{id}`")
    verdict: str = Field(description="no_gap, explained, partly_explained or unexplained")
    effects: tuple[str, ...] = Field(description="named effects; empty for no_gap and unexplained")
    probability: float = Field(description="probability of exactly these effects")
    before_n: float = Field(description="force error of the law alone, on strokes that no fit read [N]")
    after_n: float = Field(description="force error with the named effects, as expected of another run [N]")
    noise_floor_n: float = Field(description="noise floor of the recorded force [N]")
    shrinkage: float | None = Field(description="part of the gap that the effects close; null without a gap")
    shrinkage_ci95: tuple[float, float] | None = Field(description="95 % interval of the shrinkage")
    explanation: str = Field(description="two sentences for a person")


class Retry(FrozenModel):
    """One repetition of a job that had failed or was cancelled."""

    at: datetime = Field(description="UTC")
    reason: str = Field(description="reason that was given")
    after: str = Field(description="state that the repetition followed: failed or cancelled")
    error: str = Field(description="reason of that failure; empty after a cancellation")


class Job(FrozenModel):
    """One identification, diagnosis or prediction of a run, or one trend of a specimen."""

    id: str = Field(description="also the id of its fit, diagnosis or prediction")
    run: str = Field(description="id of the run")
    kind: str = Field(
        description="`identify`, `diagnose`, `predict`, or `trend` of the specimen, with its newest run"
    )
    state: JobState
    stage: str = Field(description="present stage, such as `refine`; the last one of a job that has ended")
    fraction: float | None = Field(
        description="completed share of the job, 0 to 1, by stages of different duration; null before its start"
    )
    activity: str = Field(description="present activity of a running job, for a person")
    position: int | None = Field(
        description="place in the queue, 1 for the next; null unless queued, and in live messages"
    )
    attempts: int = Field(description="number of starts by a worker, those before a retry included")
    retries: tuple[Retry, ...] = Field(description="repetitions, the first first")
    error: str = Field(description="reason of the failure")
    settings: dict[str, Any] = Field(description="requested settings")
    version: str = Field(description="version of mrbench at the request; empty in jobs of older versions")
    created: datetime = Field(description="UTC")
    started: datetime | None = Field(description="UTC of the last start by a worker")
    finished: datetime | None = Field(description="UTC")
    rmse_n: float | None = Field(
        description="force error of a fit on its samples, or of a prediction [N]; else null"
    )
    noise_floor_n: float | None = Field(description="noise floor of the recorded force [N]; null until done")
    result: str = Field(description="of a fit: `converged`, or the reason why not; empty without one")
    diagnosis: DiagnosisSummary | None = Field(description="answer of a diagnosis; null until done")


class JobPage(FrozenModel):
    """One page of jobs, newest first."""

    items: tuple[Job, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class RetryRequest(FrozenModel):
    """Request to repeat a job."""

    reason: str = Field(min_length=1, max_length=500, description="reason of the repetition, for the record")


class BatchRequest(FrozenModel):
    """Request of the same job for several runs."""

    kind: AnalysisKind
    runs: tuple[str, ...] = Field(min_length=1, max_length=1000, description="ids of the runs")
    settings: dict[str, Any] = Field(default={}, description="settings of the jobs, as for a single run")


def make_job_view(row: JobRow, places: Mapping[str, int] | None = None) -> Job:
    """Return the view of a job.

    Args:
        row: job in the catalogue.
        places: place in the queue by id of the job.
    """
    summary = row.summary or {}
    is_diagnosis = row.kind == "diagnose"
    return Job(
        id=row.id,
        run=row.run_id,
        kind=row.kind,
        state=row.state,
        stage=row.stage,
        fraction=row.fraction,
        activity=row.activity,
        position=(places or {}).get(row.id),
        attempts=row.attempts,
        retries=tuple(Retry.model_validate(entry) for entry in row.retries),
        error=row.error,
        settings=row.settings,
        version=row.version,
        created=row.created,
        started=row.started,
        finished=row.finished,
        rmse_n=summary.get("rmse_n"),
        noise_floor_n=summary.get("noise_floor_n"),
        result=summary.get("result", ""),
        diagnosis=make_diagnosis_summary(row) if is_diagnosis else None,
    )


def make_diagnosis_summary(row: JobRow) -> DiagnosisSummary | None:
    """Return the answer of a diagnosis in short, or None until it is done."""
    if row.state != "done" or row.summary is None:
        return None
    return DiagnosisSummary(id=row.id, **row.summary)


def find_newest_done(jobs: Sequence[JobRow], kind: JobKind) -> JobRow | None:
    """Return the done job of a kind that ended last; unfinished, failed and cancelled jobs hide none."""
    done = [job for job in jobs if job.kind == kind and job.state == "done"]
    return max(done, key=lambda job: (job.finished or job.created, job.id), default=None)
