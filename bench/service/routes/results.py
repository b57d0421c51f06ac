"""Routes that diagnose runs, and return fits, diagnoses, twins and reports as files."""

import asyncio
from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse

from bench.catalogue import JobFilter, JobRow, RunRow
from bench.jobs import (
    DIAGNOSIS_FILE,
    FIT_FILE,
    TWIN_FILE,
    DiagnoseSettings,
    IdentifySettings,
    Job,
    JobKind,
    JobSettings,
    get_kind,
    make_job_view,
)
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse, describe_file
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.run_registry import DAMAGED

router = APIRouter(tags=["results"], route_class=IdempotentRoute)
_VERBS: dict[JobKind, str] = {"identify": "identified", "diagnose": "diagnosed", "predict": "predicted"}
_NOUNS: dict[JobKind, str] = {"identify": "fit", "diagnose": "diagnosis"}


JSON_FILE = describe_file("application/json")
SAME_JOB: dict[int | str, dict[str, Any]] = {
    200: {"description": "an equal job is unfinished or done, and is returned; nothing was queued", "model": Job}
}


@router.post("/runs/{run_id}/identify", status_code=201, responses=SAME_JOB, dependencies=[IDEMPOTENT])
async def identify_run(
    run_id: str, context: Context, response: Response, settings: IdentifySettings | None = None
) -> Job:
    """Queue an identification, which is followed by a diagnosis if the run has none.

    201: queued, also if an equal job had failed or was cancelled. 200: an equal job is unfinished or done.
    """
    return await request_job(context, run_id, settings or IdentifySettings(), response)


@router.post("/runs/{run_id}/diagnose", status_code=201, responses=SAME_JOB, dependencies=[IDEMPOTENT])
async def diagnose_run(
    run_id: str, context: Context, response: Response, settings: DiagnoseSettings | None = None
) -> Job:
    """Queue a diagnosis of the sim-to-real gap. Its report also shows the newest fit of the run.

    201: queued, also if an equal job had failed or was cancelled. 200: an equal job is unfinished or done.
    """
    return await request_job(context, run_id, settings or DiagnoseSettings(), response)


async def request_job(context: ServiceContext, run_id: str, settings: JobSettings, response: Response) -> Job:
    """Queue a job on a run, and name its address in the answer; 200 if an equal one is unfinished or done.

    Raises:
        ProblemError: there is no such run, or its log cannot be used.
        JobError: the model of the job does not exist.
    """
    row = await asyncio.to_thread(context.get_run, run_id)
    check_complete(row, _VERBS[get_kind(settings)])
    job, is_queued = await context.job_manager.request(row, settings)
    if not is_queued:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return make_job_view(job)


def check_complete(row: RunRow, verb: str) -> None:
    """Refuse a run without a complete log, or with another one than was recorded.

    Raises:
        ProblemError: its log has no end, was changed or is missing, or the run is in the trash.
    """
    if row.trashed is not None:
        raise make_conflict("in-trash", "In the trash", f"run {row.id} is in the trash; restore it first")
    if row.log_sha256 is None:
        raise make_conflict(
            "run-not-ended", "No complete log", f"run {row.id} is {row.state}; only a complete log can be {verb}"
        )
    if row.integrity in DAMAGED:
        raise make_conflict(
            "log-damaged",
            "The log is not the recorded one",
            f"the log of run {row.id} is {row.integrity}; its fits are those of the recorded log "
            f"(SHA-256 {row.log_sha256}); restore it from a backup",
        )


@router.get("/runs/{run_id}/fit", response_class=FileResponse, responses=JSON_FILE)
def get_newest_fit(run_id: str, context: Context) -> SnapshotResponse:
    """Return the newest fit of a run, `mrbench.fit/1`."""
    return make_file_response(context, find_newest(context, run_id, "identify"), FIT_FILE)


@router.get("/runs/{run_id}/diagnosis", response_class=FileResponse, responses=JSON_FILE)
def get_newest_diagnosis(run_id: str, context: Context) -> SnapshotResponse:
    """Return the newest diagnosis of a run, `mrbench.diagnosis/1`."""
    return make_file_response(context, find_newest(context, run_id, "diagnose"), DIAGNOSIS_FILE)


@router.get("/fits/{fit_id}", response_class=FileResponse, responses=JSON_FILE)
def get_fit(fit_id: str, context: Context) -> SnapshotResponse:
    """Return a fit, `mrbench.fit/1`; its id is that of its job."""
    return make_file_response(context, get_done_job(context, fit_id, "identify", "fit"), FIT_FILE)


@router.get("/diagnoses/{diagnosis_id}", response_class=FileResponse, responses=JSON_FILE)
def get_diagnosis(diagnosis_id: str, context: Context) -> SnapshotResponse:
    """Return a diagnosis, `mrbench.diagnosis/1`; its id is that of its job."""
    return make_file_response(
        context, get_done_job(context, diagnosis_id, "diagnose", "diagnosis"), DIAGNOSIS_FILE
    )


@router.get("/twins/{diagnosis_id}", response_class=FileResponse, responses=JSON_FILE)
def get_twin(diagnosis_id: str, context: Context) -> SnapshotResponse:
    """Return the twin of a diagnosis, `mrbench.scenario/1`; it has the id of the diagnosis."""
    return make_file_response(context, get_done_job(context, diagnosis_id, "diagnose", "twin"), TWIN_FILE)


def get_done_job(context: ServiceContext, job_id: str, kind: JobKind, noun: str) -> JobRow:
    """Return a job of a kind that is done.

    Raises:
        ProblemError: there is none, or it is not done; the message says why.
    """
    job = context.catalogue.get_job(job_id)
    if job is None or job.kind != kind:
        raise make_not_found(noun, job_id)
    if job.result is None:
        raise make_not_found(noun, f"{job_id} yet; {_describe_state(job)}")
    return job


def find_newest(context: ServiceContext, run_id: str, kind: JobKind) -> JobRow:
    """Return the newest job of a kind of a run that is done.

    Raises:
        ProblemError: there is no such run, or no such job; the message says why.
    """
    row, queue = context.get_run(run_id), context.catalogue.job_queue
    done = queue.find_newest_done(row.id, kind)
    if done is None:
        raise _make_missing(row, kind, next(iter(queue.list_jobs(JobFilter(kind=kind, run_id=row.id), 1)), None))
    return done


def _make_missing(row: RunRow, kind: JobKind, newest: JobRow | None) -> ProblemError:
    what = f"{_NOUNS[kind]} of run"
    if newest is None:
        return make_not_found(what, f"{row.id}; request one: POST /api/v1/runs/{row.id}/{kind}")
    return make_not_found(what, f"{row.id}; {_describe_state(newest)}")


def _describe_state(job: JobRow) -> str:
    return f"its newest job is {job.state}{f': {job.error}' if job.error else ''}"


def make_file_response(context: ServiceContext, job: JobRow, name: str) -> SnapshotResponse:
    """Return a file of the result of a job.

    Raises:
        ProblemError: the file was removed.
    """
    path = context.catalogue.resolve_path(job.result or "") / name
    try:
        return SnapshotResponse(path, "application/json", f"{job.run_id}.{name}", inline=True)
    except FileNotFoundError:
        what = f"{name} of run"
        raise make_not_found(what, f"{job.run_id}: {path} was removed; request the job again") from None
