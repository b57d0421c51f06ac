"""Runs: started, stopped, listed, with their files."""

import asyncio
import time
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from bench.agent_protocol import AgentStatus, RunCommand, StatusCommand, StopCommand
from bench.catalogue import RunRow, catalogue_log
from bench.errors import RunError
from bench.jobs import FIT_FILE, REPORT_FILE, IdentifySettings
from bench.log import salvage_log as mend
from bench.methods import Method, compile_method, parse_method
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.routes.methods import load_shipped_method
from bench.service.views import Job, Run, RunPage, StartRunRequest, make_job_view

router = APIRouter(prefix="/runs", tags=["runs"])
_START_TIMEOUT = 5.0
"""[s] from a command that was accepted to a run that has an id."""


def _describe_file(media_type: str) -> dict[int | str, dict[str, Any]]:
    return {200: {"description": "The file", "content": {media_type: {}}}}


@router.post("", status_code=201)
async def start_run(wanted: StartRunRequest, context: Context, response: Response) -> Run:
    """Start a run; it goes on by itself and is recorded whatever becomes of the service."""
    method = await asyncio.to_thread(_check_method, wanted.method)
    run_id, status = await asyncio.to_thread(_request_start, context, method, wanted)
    await context.registry.observe(status)
    response.headers["Location"] = f"/api/v1/runs/{run_id}"
    return await asyncio.to_thread(_make_view, context, run_id)


def _make_view(context: ServiceContext, run_id: str) -> Run:
    return context.make_run_views(context.get_run(run_id))[0]


def _check_method(wanted: str | dict[str, Any]) -> Method:
    """The method, once it has been compiled within its own limits.

    Raises:
        MethodError: it has not its form, or exceeds its limits.
        ProblemError: no method of that name ships with the product.
    """
    if isinstance(wanted, str):
        return load_shipped_method(wanted)
    method = parse_method(wanted, "what was sent")
    compile_method(method)
    return method


def _request_start(context: ServiceContext, method: Method, wanted: StartRunRequest) -> tuple[str, AgentStatus]:
    """Send the command, and wait until the agent says which run it has become."""
    # Until the new run has its id, the agent shows the last one.
    before = context.monitor.get_status().run
    stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S}.{time.time_ns() // 1_000_000 % 1000:03d}Z"
    command = RunCommand(
        method=method.model_dump(mode="json", by_alias=True, exclude_defaults=True),
        specimen=wanted.specimen,
        operator=wanted.operator,
        resume_after=wanted.resume_after,
        log=str(context.data / f"{stamp}-{method.name}.mcap") if context.has_local_logs else None,
    )
    status = context.monitor.send_command(command)
    deadline = time.monotonic() + _START_TIMEOUT
    while status.run is None or (before is not None and status.run.id == before.id):
        if time.monotonic() > deadline:
            raise RunError(f"the rig agent accepted the run and did not begin it within {_START_TIMEOUT:g} s")
        status = context.monitor.send_command(StatusCommand())
    return status.run.id, status


@router.get("")
def list_runs(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="how many at most")] = 50,
    before: Annotated[str | None, Query(description="`next` of the page before")] = None,
) -> RunPage:
    """Runs, newest first."""
    # One more than is shown: it tells whether there is a next page.
    rows = context.catalogue.list_runs(limit + 1, None if before is None else context.get_run(before))
    shown = rows[:limit]
    return RunPage(items=tuple(context.make_run_views(*shown)), next=shown[-1].id if len(rows) > limit else None)


@router.get("/{run_id}")
def get_run(run_id: str, context: Context) -> Run:
    """One run, with its progress while it goes on, its jobs, and the newest fit in short."""
    return _make_view(context, run_id)


@router.post("/{run_id}/stop")
def stop_run(run_id: str, context: Context) -> AgentStatus:
    """End a run in good order: the motion fades out, the coil goes to zero. Harmless when nothing runs.

    Refused only while it is another run that goes on; the catalogue is not asked.
    """
    status = context.monitor.latest_status
    other = status.run if status else None
    if other is not None and other.id != run_id and other.outcome is None:
        raise make_conflict(
            "another-run", "Another run goes on", f"it is run {other.id} that goes on; stop that one"
        )
    return context.monitor.send_command(StopCommand())


@router.post("/{run_id}/salvage")
async def salvage_run(run_id: str, context: Context) -> Run:
    """Mend the log of a run whose recorder was killed; the broken one is kept beside it."""
    row = await asyncio.to_thread(context.get_run, run_id)
    if row.state != "truncated":
        # Names of problems are stable: this one is older than the name of the state.
        raise make_conflict(
            "not-cut-off",
            "Nothing to repair",
            f"the log of run {run_id} is not truncated; its state is {row.state}",
        )
    await asyncio.to_thread(_salvage_log, context, row)
    return await asyncio.to_thread(_make_view, context, run_id)


def _salvage_log(context: ServiceContext, row: RunRow) -> None:
    path = context.catalogue.resolve_path(row.log)
    mend(path)
    catalogue_log(context.catalogue, path)


@router.post("/{run_id}/identify", status_code=201)
async def identify_run(
    run_id: str, context: Context, response: Response, settings: IdentifySettings | None = None
) -> Job:
    """Identify a run with these settings; 200 and the job that there is, where that is done or on its way."""
    row = await asyncio.to_thread(context.get_run, run_id)
    if row.log_sha256 is None:
        raise make_conflict(
            "run-not-ended", "No whole log", f"run {run_id} is {row.state}; only a whole log is identified"
        )
    job, new = await context.job_manager.identify(row, settings or IdentifySettings())
    if not new:
        response.status_code = 200
    return make_job_view(job)


@router.get("/{run_id}/log", response_class=FileResponse, responses=_describe_file("application/octet-stream"))
def get_log(run_id: str, context: Context) -> FileResponse:
    """The log, as MCAP; while the run goes on, what stands in it so far."""
    path = context.catalogue.resolve_path(context.get_run(run_id).log)
    if not path.is_file():
        raise make_not_found("log of run", f"{run_id} on this machine: {path}")
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.get("/{run_id}/fit", response_class=FileResponse, responses=_describe_file("application/json"))
def get_fit(run_id: str, context: Context) -> FileResponse:
    """The newest fit, `mrbench.fit/1`."""
    return _make_result_response(context, run_id, FIT_FILE, "application/json")


@router.get("/{run_id}/report", response_class=FileResponse, responses=_describe_file("text/html"))
def get_report(run_id: str, context: Context) -> FileResponse:
    """The report of the newest fit, one self-contained page."""
    return _make_result_response(context, run_id, REPORT_FILE, "text/html")


def _make_result_response(context: ServiceContext, run_id: str, name: str, media_type: str) -> FileResponse:
    row = context.get_run(run_id)
    done = next(
        (job for job in context.catalogue.list_jobs(50, [row.id]) if job.state == "done" and job.result), None
    )
    if done is None or done.result is None:
        raise _make_not_identified(context, row)
    path = context.catalogue.resolve_path(done.result) / name
    if not path.is_file():
        raise make_not_found(f"{name} of run", f"{run_id}: {path} was taken away")
    return FileResponse(
        path, media_type=media_type, filename=f"{row.id}.{name}", content_disposition_type="inline"
    )


def _make_not_identified(context: ServiceContext, row: RunRow) -> ProblemError:
    newest = next(iter(context.catalogue.list_jobs(1, [row.id])), None)
    if newest is None:
        return make_not_found("fit of run", f"{row.id}; ask for one: POST /api/v1/runs/{row.id}/identify")
    why = f": {newest.error}" if newest.error else ""
    return make_not_found("fit of run", f"{row.id}; its newest job is {newest.state}{why}")
