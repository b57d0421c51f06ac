"""Routes of batches, and of the changes between two results."""

import asyncio
import json
import uuid
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from bench.catalogue import BatchRow, JobFilter, JobRow
from bench.errors import BenchError
from bench.jobs import DIAGNOSIS_FILE, FIT_FILE, PREDICTION_FILE, BatchRequest, JobSettings, parse_settings
from bench.results import Batch, ResultChanges, compare_results, make_batch_view, write_csv
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.routes.results import check_complete

router = APIRouter(tags=["jobs"], route_class=IdempotentRoute)
_MAX_RESULTS = 200
"""Largest number of earlier results that are searched for one of another version."""
_FILES = {"identify": FIT_FILE, "diagnose": DIAGNOSIS_FILE, "predict": PREDICTION_FILE}
"""File with the answer of a job, by its kind."""
_CSV: dict[int | str, dict[str, Any]] = {200: {"description": "the table", "content": {"text/csv": {}}}}


@router.post("/batches", status_code=201, dependencies=[IDEMPOTENT])
async def start_batch(request: BatchRequest, context: Context, response: Response) -> Batch:
    """Queue the same job for several runs; the table names the reason for each run that is refused."""
    settings = _parse_settings(request)
    items = [await _request_job(context, run_id, settings) for run_id in dict.fromkeys(request.runs)]
    batch = BatchRow(
        id=uuid.uuid4().hex,
        kind=request.kind,
        settings=settings.model_dump(mode="json"),
        created=datetime.now(UTC),
        items=items,
    )
    await asyncio.to_thread(context.catalogue.job_queue.add_batch, batch)
    response.headers["Location"] = f"/api/v1/batches/{batch.id}"
    return await asyncio.to_thread(_make_view, context, batch)


def _parse_settings(request: BatchRequest) -> JobSettings:
    try:
        return parse_settings(request.kind, request.settings)
    except ValidationError as error:
        faults = [
            fault | {"loc": ("body", "settings", *fault["loc"])} for fault in error.errors(include_url=False)
        ]
        raise RequestValidationError(faults) from None


async def _request_job(context: ServiceContext, run_id: str, settings: JobSettings) -> dict[str, str]:
    """Queue the job of one run; return its id, or the reason of a refusal."""
    try:
        row = await asyncio.to_thread(context.get_run, run_id)
        check_complete(row, "analysed")
        job, _ = await context.job_manager.request(row, settings)
    except (ProblemError, BenchError) as error:
        return {"run": run_id, "reason": str(error)}
    return {"run": run_id, "job": job.id}


@router.get("/batches/{batch_id}")
def get_batch(batch_id: str, context: Context) -> Batch:
    """Return a batch with the table of its results so far."""
    return _make_view(context, _get_batch(context, batch_id))


@router.get("/batches/{batch_id}/table", response_class=Response, responses=_CSV)
def get_batch_table(batch_id: str, context: Context) -> Response:
    """Return the table of a batch as CSV."""
    return Response(write_csv(_make_view(context, _get_batch(context, batch_id))), media_type="text/csv")


def _get_batch(context: ServiceContext, batch_id: str) -> BatchRow:
    batch = context.catalogue.job_queue.get_batch(batch_id)
    if batch is None:
        raise make_not_found("batch", batch_id)
    return batch


def _make_view(context: ServiceContext, batch: BatchRow) -> Batch:
    jobs = context.catalogue.job_queue.get_jobs([item["job"] for item in batch.items if "job" in item])
    found = (context.catalogue.get_run(item["run"]) for item in batch.items)
    return make_batch_view(batch, jobs, {run.id: run for run in found if run is not None})


@router.get("/jobs/{job_id}/changes")
def get_changes(
    job_id: str,
    context: Context,
    since: Annotated[
        str | None,
        Query(description="id of the earlier job; by default the newest result of another version of mrbench"),
    ] = None,
) -> ResultChanges:
    """Compare a result with an earlier one of the same run and kind: answer, effects, parameters."""
    newer = context.get_job(job_id)
    older = _find_older(context, newer) if since is None else context.get_job(since)
    if (older.kind, older.run_id) != (newer.kind, newer.run_id):
        raise make_not_found(f"result of run {newer.run_id} and kind {newer.kind} with the id", older.id)
    documents = [_read_document(context, job) for job in (older, newer)]
    return compare_results(documents[0], documents[1], (older.id, newer.id))


def _find_older(context: ServiceContext, newer: JobRow) -> JobRow:
    selection = JobFilter(("done",), newer.kind, newer.run_id)
    for job in context.catalogue.job_queue.list_jobs(selection, _MAX_RESULTS, newer):
        if job.version != newer.version:
            return job
    raise make_not_found("earlier result of another version for job", f"{newer.id}; name one with `since`")


def _read_document(context: ServiceContext, job: JobRow) -> Any:
    name = _FILES[job.kind]
    path = context.catalogue.resolve_path(job.result or "") / name
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError):
        raise make_not_found("result of job", f"{job.id}; its state is {job.state}") from None
