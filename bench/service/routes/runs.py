"""Runs: started, stopped, listed, with their files."""

import asyncio
import time
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from bench.agent.messages import AgentStatus, RunCommand, StatusCommand, StopCommand
from bench.catalogue.models import RunRow
from bench.catalogue.scan import catalogue_log
from bench.errors import RunError
from bench.jobs.order import FIT, REPORT, IdentifySettings
from bench.methods import Method, compile_method
from bench.methods.document import method_of
from bench.recorder.salvage import salvage as mend
from bench.service.desk import AtDesk, Desk
from bench.service.problems import ProblemError, conflict, not_found
from bench.service.routes.methods import shipped
from bench.service.views import Job, Run, RunPage, StartRun, job_view

router = APIRouter(prefix="/runs", tags=["runs"])
_START_WITHIN = 5.0
"""[s] from a command that was accepted to a run that has an id."""


def _file(media_type: str) -> dict[int | str, dict[str, Any]]:
    return {200: {"description": "The file", "content": {media_type: {}}}}


@router.post("", status_code=201)
async def start(wanted: StartRun, desk: AtDesk, response: Response) -> Run:
    """Start a run; it goes on by itself and is recorded whatever becomes of the service."""
    method = await asyncio.to_thread(_checked, wanted.method)
    run_id, status = await asyncio.to_thread(_start, desk, method, wanted)
    await desk.book.observe(status)
    response.headers["Location"] = f"/api/v1/runs/{run_id}"
    return await asyncio.to_thread(_shown, desk, run_id)


def _shown(desk: Desk, run_id: str) -> Run:
    return desk.shown(desk.run(run_id))[0]


def _checked(wanted: str | dict[str, Any]) -> Method:
    """The method, once it has been compiled within its own limits.

    Raises:
        MethodError: it has not its form, or exceeds its limits.
        ProblemError: no method of that name ships with the product.
    """
    if isinstance(wanted, str):
        return shipped(wanted)
    method = method_of(wanted, "what was sent")
    compile_method(method)
    return method


def _start(desk: Desk, method: Method, wanted: StartRun) -> tuple[str, AgentStatus]:
    """Send the command, and wait until the agent says which run it has become."""
    # Until the new run has its id, the agent shows the last one.
    before = desk.watch.status().run
    stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S}.{time.time_ns() // 1_000_000 % 1000:03d}Z"
    command = RunCommand(
        method=method.model_dump(mode="json", by_alias=True, exclude_defaults=True),
        specimen=wanted.specimen,
        operator=wanted.operator,
        resume_after=wanted.resume_after,
        log=str(desk.data / f"{stamp}-{method.name}.mcap") if desk.logs_here else None,
    )
    status = desk.watch.command(command)
    deadline = time.monotonic() + _START_WITHIN
    while status.run is None or (before is not None and status.run.id == before.id):
        if time.monotonic() > deadline:
            raise RunError(f"the rig agent accepted the run and did not begin it within {_START_WITHIN:g} s")
        status = desk.watch.command(StatusCommand())
    return status.run.id, status


@router.get("")
def runs(
    desk: AtDesk,
    limit: Annotated[int, Query(ge=1, le=200, description="how many at most")] = 50,
    before: Annotated[str | None, Query(description="`next` of the page before")] = None,
) -> RunPage:
    """Runs, newest first."""
    # One more than is shown: it tells whether there is a next page.
    rows = desk.catalogue.runs(limit + 1, None if before is None else desk.run(before))
    shown = rows[:limit]
    return RunPage(items=tuple(desk.shown(*shown)), next=shown[-1].id if len(rows) > limit else None)


@router.get("/{run_id}")
def run(run_id: str, desk: AtDesk) -> Run:
    """One run, with its progress while it goes on, its jobs, and the newest fit in short."""
    return _shown(desk, run_id)


@router.post("/{run_id}/stop")
def stop(run_id: str, desk: AtDesk) -> AgentStatus:
    """End a run in good order: the motion fades out, the coil goes to zero. Harmless when nothing runs.

    Refused only while it is another run that goes on; the catalogue is not asked.
    """
    status = desk.watch.latest
    other = status.run if status else None
    if other is not None and other.id != run_id and other.outcome is None:
        raise conflict("another-run", "Another run goes on", f"it is run {other.id} that goes on; stop that one")
    return desk.watch.command(StopCommand())


@router.post("/{run_id}/salvage")
async def salvage(run_id: str, desk: AtDesk) -> Run:
    """Mend the log of a run whose recorder was killed; the broken one is kept beside it."""
    row = await asyncio.to_thread(desk.run, run_id)
    if row.state != "cut_off":
        raise conflict("not-cut-off", "Nothing to mend", f"the log of run {run_id} is not cut off: {row.state}")
    await asyncio.to_thread(_salvage, desk, row)
    return await asyncio.to_thread(_shown, desk, run_id)


def _salvage(desk: Desk, row: RunRow) -> None:
    path = desk.catalogue.path_of(row.log)
    mend(path)
    catalogue_log(desk.catalogue, path)


@router.post("/{run_id}/identify", status_code=201)
async def identify(run_id: str, desk: AtDesk, response: Response, settings: IdentifySettings | None = None) -> Job:
    """Identify a run with these settings; 200 and the job that there is, where that is done or on its way."""
    row = await asyncio.to_thread(desk.run, run_id)
    if row.log_sha256 is None:
        raise conflict(
            "run-not-ended", "No whole log", f"run {run_id} is {row.state}; only a whole log is identified"
        )
    job, new = await desk.keeper.identify(row, settings or IdentifySettings())
    if not new:
        response.status_code = 200
    return job_view(job)


@router.get("/{run_id}/log", response_class=FileResponse, responses=_file("application/octet-stream"))
def log(run_id: str, desk: AtDesk) -> FileResponse:
    """The log, as MCAP; while the run goes on, what stands in it so far."""
    path = desk.catalogue.path_of(desk.run(run_id).log)
    if not path.is_file():
        raise not_found("log of run", f"{run_id} on this machine: {path}")
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.get("/{run_id}/fit", response_class=FileResponse, responses=_file("application/json"))
def fit(run_id: str, desk: AtDesk) -> FileResponse:
    """The newest fit, `mrbench.fit/1`."""
    return _result(desk, run_id, FIT, "application/json")


@router.get("/{run_id}/report", response_class=FileResponse, responses=_file("text/html"))
def report(run_id: str, desk: AtDesk) -> FileResponse:
    """The report of the newest fit, one self-contained page."""
    return _result(desk, run_id, REPORT, "text/html")


def _result(desk: Desk, run_id: str, name: str, media_type: str) -> FileResponse:
    row = desk.run(run_id)
    done = next((job for job in desk.catalogue.jobs(50, [row.id]) if job.state == "done" and job.result), None)
    if done is None or done.result is None:
        raise _not_identified(desk, row)
    path = desk.catalogue.path_of(done.result) / name
    if not path.is_file():
        raise not_found(f"{name} of run", f"{run_id}: {path} was taken away")
    return FileResponse(
        path, media_type=media_type, filename=f"{row.id}.{name}", content_disposition_type="inline"
    )


def _not_identified(desk: Desk, row: RunRow) -> ProblemError:
    newest = next(iter(desk.catalogue.jobs(1, [row.id])), None)
    if newest is None:
        return not_found("fit of run", f"{row.id}; ask for one: POST /api/v1/runs/{row.id}/identify")
    why = f": {newest.error}" if newest.error else ""
    return not_found("fit of run", f"{row.id}; its newest job is {newest.state}{why}")
