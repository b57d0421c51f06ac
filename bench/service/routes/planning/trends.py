"""Routes of a specimen over its runs: parameters of the fits, and the trend with its cause."""

import asyncio
import json
from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from bench.catalogue import JobFilter, RunRow
from bench.jobs import FIT_FILE, TREND_FILE, Job, TrendSettings, make_job_view
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse, describe_file
from bench.service.problems import make_conflict, make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.routes.planning.views import ParameterValue, RunParameters, SpecimenParameters
from bench.service.routes.results import SAME_JOB
from bench.service.run_registry import DAMAGED

router = APIRouter(prefix="/specimens", tags=["specimens"], route_class=IdempotentRoute)
_LEAST_RUNS = 3
"""Smallest number of runs of a trend."""
_MOST_RUNS = 50
"""Largest number of runs of a trend, the newest ones."""
_OUTCOMES = ("clean", "lossy")
"""Outcomes of the runs that a trend reads."""
_FILE = describe_file("application/json")


@router.get("/{serial:path}/trend", response_class=FileResponse, responses=_FILE)
def get_trend(serial: str, context: Context) -> SnapshotResponse:
    """Return the newest trend of a specimen, `mrbench.trend/1`."""
    queue = context.catalogue.job_queue
    # A trend belongs to the run that was its newest.
    for run in reversed(_list_runs(context, serial)):
        job = queue.find_newest_done(run.id, "trend")
        path = None if job is None else context.catalogue.resolve_path(job.result or "") / TREND_FILE
        if path is not None and path.is_file():
            return SnapshotResponse(path, "application/json", f"{run.id}.{TREND_FILE}", inline=True)
        newest = next(iter(queue.list_jobs(JobFilter(kind="trend", run_id=run.id), 1)), None)
        if newest is not None:
            reason = f": {newest.error}" if newest.error else ""
            raise make_not_found(
                "trend of specimen", f"{serial} yet; its job {newest.id} is {newest.state}{reason}"
            )
    raise make_not_found("trend of specimen", f"{serial}; request one: POST to the same address")


@router.post("/{serial:path}/trend", status_code=201, responses=SAME_JOB, dependencies=[IDEMPOTENT])
async def request_trend(serial: str, context: Context, response: Response) -> Job:
    """Queue the trend over the newest runs of a specimen; it belongs to the newest of them.

    201: queued. 200: an equal job is unfinished or done.
    """
    runs = await asyncio.to_thread(_list_runs, context, serial)
    usable = [run for run in runs if run.outcome in _OUTCOMES and run.integrity not in DAMAGED]
    if len(usable) < _LEAST_RUNS:
        detail = f"a trend needs {_LEAST_RUNS} runs with a complete log; specimen {serial} has {len(usable)}"
        raise make_conflict("too-few-runs", "Too few runs", detail)
    job, is_queued = await context.job_manager.request(
        usable[-1], TrendSettings(runs=tuple(run.id for run in usable))
    )
    if not is_queued:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return make_job_view(job)


@router.get("/{serial:path}/parameters")
def get_parameters(
    serial: str,
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of runs, the newest ones")] = 50,
) -> SpecimenParameters:
    """Return the parameters of the newest fit of each run of a specimen, the oldest first."""
    found = (_read_parameters(context, run) for run in _list_runs(context, serial, limit))
    return SpecimenParameters(items=tuple(one for one in found if one is not None))


def _list_runs(context: ServiceContext, serial: str, limit: int = _MOST_RUNS) -> Sequence[RunRow]:
    if context.catalogue.specimens.find(serial) is None:
        raise make_not_found("specimen", serial)
    return context.catalogue.specimens.list_runs(serial, limit)


def _read_parameters(context: ServiceContext, run: RunRow) -> RunParameters | None:
    """Return the parameters of the newest fit of a run; None without one, or if its file was removed."""
    job = context.catalogue.job_queue.find_newest_done(run.id, "identify")
    if job is None:
        return None
    try:
        fit = json.loads((context.catalogue.resolve_path(job.result or "") / FIT_FILE).read_bytes())
        values = {name: _make_value(one) for name, one in fit["parameters"].items()}
    except (OSError, ValueError, KeyError):
        return None
    return RunParameters(run=run.id, started=run.started, fit=job.id, parameters=values)


def _make_value(estimate: dict[str, Any]) -> ParameterValue:
    return ParameterValue(
        value=estimate["value"],
        unit=estimate["unit"],
        ci95=estimate.get("ci95"),
        identifiable=estimate.get("identifiable", False),
    )
