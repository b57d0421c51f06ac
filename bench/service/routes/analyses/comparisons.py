"""Routes that compare two or more runs."""

import json
from http import HTTPStatus
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query

from bench.catalogue import JobRow
from bench.comparison import (
    ComparedRun,
    Comparison,
    ComparisonRequest,
    ForceSeries,
    RecordedRun,
    compare_runs,
    read_force_series,
)
from bench.errors import LogError
from bench.jobs import FIT_FILE, SERIES_FILE
from bench.samples import SampleTable
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, shorten
from bench.service.routes.recordings import load_samples

router = APIRouter(tags=["comparisons"])
_MAX_RUNS = 20


@router.get("/comparisons")
def get_comparison(
    context: Context,
    run: Annotated[list[str], Query(min_length=2, max_length=_MAX_RUNS, description="id of a run; repeated")],
    reference: Annotated[str | None, Query(description="id of the run with the tolerance band")] = None,
    tolerance_percent: Annotated[
        float, Query(gt=0, le=100, description="tolerance in percent of the reference's peak force")
    ] = 10.0,
) -> Comparison:
    """Compare runs with the first one; the address of a comparison can be kept and sent."""
    request = ComparisonRequest(runs=tuple(run), reference=reference, tolerance_percent=tolerance_percent)
    return make_comparison(request, context)


@router.post("/comparisons")
def make_comparison(request: ComparisonRequest, context: Context) -> Comparison:
    """Compare runs with the first one; for lists that are too long for an address. Nothing is stored."""
    _check_runs(request)
    return compare_runs([_load(context, run_id) for run_id in request.runs], request)


def _check_runs(request: ComparisonRequest) -> None:
    if len(set(request.runs)) < len(request.runs):
        raise _refuse("runs: a run is named twice; name each run once")
    if request.reference is not None and request.reference not in request.runs:
        raise _refuse(f"reference: {shorten(request.reference)} is not among the runs; add it to them")


def _refuse(detail: str) -> ProblemError:
    return ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)


def _load(context: ServiceContext, run_id: str) -> RecordedRun:
    row = context.get_run(run_id)
    table = _load_table(context, run_id)
    job = context.catalogue.job_queue.find_newest_done(run_id, "identify")
    facts = ComparedRun(
        run=run_id,
        specimen=row.specimen,
        method=row.method,
        started=row.started,
        fit=job.id if job else None,
    )
    return RecordedRun(facts, table, _read_fit(context, job), _read_series(context, job))


def _load_table(context: ServiceContext, run_id: str) -> SampleTable:
    try:
        return load_samples(context, run_id)
    except LogError as error:
        raise LogError(f"run {shorten(run_id)}: {error}; or compare without this run") from error


def _read_fit(context: ServiceContext, job: JobRow | None) -> dict[str, Any] | None:
    try:
        document: dict[str, Any] = json.loads((_get_folder(context, job) / FIT_FILE).read_bytes())
    except (OSError, ValueError):
        return None
    return document


def _read_series(context: ServiceContext, job: JobRow | None) -> ForceSeries | None:
    try:
        return read_force_series(_get_folder(context, job) / SERIES_FILE)
    except LogError:
        return None


def _get_folder(context: ServiceContext, job: JobRow | None) -> Path:
    """Return the folder of the results of a job; one that does not exist without a job."""
    return context.catalogue.resolve_path(job.result if job and job.result else ".no-result")
