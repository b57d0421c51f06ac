"""Routes that start, stop, list, repair and identify runs and return their files."""

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
from bench.log import salvage_log
from bench.methods import Method, compile_method, parse_method
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.routes.methods import load_shipped_method
from bench.service.views import Job, Run, RunPage, StartRunRequest, make_job_view

router = APIRouter(prefix="/runs", tags=["runs"])
_START_TIMEOUT = 5.0
"""Time limit from an accepted command to the id of the run [s]."""


def _describe_file(media_type: str) -> dict[int | str, dict[str, Any]]:
    return {200: {"description": "the file", "content": {media_type: {}}}}


@router.post("", status_code=201)
async def start_run(request: StartRunRequest, context: Context, response: Response) -> Run:
    """Start a run; the agent executes and records it even if the service ends."""
    method = await asyncio.to_thread(_check_method, request.method)
    run_id, status = await asyncio.to_thread(_request_start, context, method, request)
    await context.registry.observe(status)
    response.headers["Location"] = f"/api/v1/runs/{run_id}"
    return await asyncio.to_thread(_make_view, context, run_id)


def _make_view(context: ServiceContext, run_id: str) -> Run:
    return context.make_run_views(context.get_run(run_id))[0]


def _check_method(method: str | dict[str, Any]) -> Method:
    """Return a method, by name or from its document, after it was compiled within its limits.

    Raises:
        MethodError: the document is invalid, or the method exceeds its limits.
        ProblemError: there is no included method with this name.
    """
    if isinstance(method, str):
        return load_shipped_method(method)
    parsed = parse_method(method, "the request")
    compile_method(parsed)
    return parsed


def _request_start(context: ServiceContext, method: Method, request: StartRunRequest) -> tuple[str, AgentStatus]:
    """Send the command, and wait until the agent reports the id of the new run."""
    # Until the new run has an id, the agent reports the previous run.
    before = context.monitor.get_status().run
    stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S}.{time.time_ns() // 1_000_000 % 1000:03d}Z"
    command = RunCommand(
        method=method.model_dump(mode="json", by_alias=True, exclude_defaults=True),
        specimen=request.specimen,
        operator=request.operator,
        resume_after=request.resume_after,
        log=str(context.data / f"{stamp}-{method.name}.mcap") if context.has_local_logs else None,
    )
    status = context.monitor.send_command(command)
    deadline = time.monotonic() + _START_TIMEOUT
    while status.run is None or (before is not None and status.run.id == before.id):
        if time.monotonic() > deadline:
            raise RunError(f"the rig agent accepted the run but did not start it within {_START_TIMEOUT:g} s")
        status = context.monitor.send_command(StatusCommand())
    return status.run.id, status


@router.get("")
def list_runs(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
) -> RunPage:
    """List the runs, newest first."""
    # One run more than shown, to find out whether there is a next page.
    rows = context.catalogue.list_runs(limit + 1, None if before is None else context.get_run(before))
    page = rows[:limit]
    return RunPage(items=tuple(context.make_run_views(*page)), next=page[-1].id if len(rows) > limit else None)


@router.get("/{run_id}")
def get_run(run_id: str, context: Context) -> Run:
    """Return one run with its progress, its jobs and the result of its newest fit."""
    return _make_view(context, run_id)


@router.post("/{run_id}/stop")
def stop_run(run_id: str, context: Context) -> AgentStatus:
    """Stop a run in a controlled way: the motion fades out, the coil goes to zero. Harmless without a run.

    Refused only while another run is in progress; the run need not be in the catalogue.
    """
    status = context.monitor.latest_status
    other = status.run if status else None
    if other is not None and other.id != run_id and other.outcome is None:
        raise make_conflict(
            "another-run", "Another run is in progress", f"run {other.id} is in progress; stop that one"
        )
    return context.monitor.send_command(StopCommand())


@router.post("/{run_id}/salvage")
async def salvage_run(run_id: str, context: Context) -> Run:
    """Repair the truncated log of a run whose recorder was killed; the original is kept next to it."""
    row = await asyncio.to_thread(context.get_run, run_id)
    if row.state != "truncated":
        # Names of problems are stable; this one is older than the name of the state.
        raise make_conflict(
            "not-cut-off",
            "Nothing to repair",
            f"the log of run {run_id} is not truncated; its state is {row.state}",
        )
    await asyncio.to_thread(_repair_log, context, row)
    return await asyncio.to_thread(_make_view, context, run_id)


def _repair_log(context: ServiceContext, row: RunRow) -> None:
    path = context.catalogue.resolve_path(row.log)
    salvage_log(path)
    catalogue_log(context.catalogue, path)


@router.post("/{run_id}/identify", status_code=201)
async def identify_run(
    run_id: str, context: Context, response: Response, settings: IdentifySettings | None = None
) -> Job:
    """Create an identification job; if an equal one is unfinished or done, return that one with status 200."""
    row = await asyncio.to_thread(context.get_run, run_id)
    if row.log_sha256 is None:
        raise make_conflict(
            "run-not-ended",
            "No complete log",
            f"run {run_id} is {row.state}; only a complete log can be identified",
        )
    job, new = await context.job_manager.identify(row, settings or IdentifySettings())
    if not new:
        response.status_code = 200
    return make_job_view(job)


@router.get("/{run_id}/log", response_class=FileResponse, responses=_describe_file("application/octet-stream"))
def get_log(run_id: str, context: Context) -> FileResponse:
    """Return the log as MCAP; during the run, the part written so far."""
    path = context.catalogue.resolve_path(context.get_run(run_id).log)
    if not path.is_file():
        raise make_not_found("log of run", f"{run_id} on this machine: {path}")
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.get("/{run_id}/fit", response_class=FileResponse, responses=_describe_file("application/json"))
def get_fit(run_id: str, context: Context) -> FileResponse:
    """Return the newest fit, `mrbench.fit/1`."""
    return _make_result_response(context, run_id, FIT_FILE, "application/json")


@router.get("/{run_id}/report", response_class=FileResponse, responses=_describe_file("text/html"))
def get_report(run_id: str, context: Context) -> FileResponse:
    """Return the report on the newest fit, one self-contained page."""
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
        raise make_not_found(f"{name} of run", f"{run_id}: {path} was removed")
    return FileResponse(
        path, media_type=media_type, filename=f"{row.id}.{name}", content_disposition_type="inline"
    )


def _make_not_identified(context: ServiceContext, row: RunRow) -> ProblemError:
    newest = next(iter(context.catalogue.list_jobs(1, [row.id])), None)
    if newest is None:
        return make_not_found("fit of run", f"{row.id}; request one: POST /api/v1/runs/{row.id}/identify")
    reason = f": {newest.error}" if newest.error else ""
    return make_not_found("fit of run", f"{row.id}; its newest job is {newest.state}{reason}")
