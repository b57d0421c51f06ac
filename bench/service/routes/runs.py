"""Routes that start, stop, list and repair runs."""

import asyncio
import time
from contextlib import suppress
from datetime import UTC, date, datetime
from http import HTTPStatus
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from bench.agent_protocol import AbortCommand, AgentStatus, RunCommand, RunStatus, StatusCommand, StopCommand
from bench.catalogue import CatalogueUnavailableError, RunRow, catalogue_log
from bench.errors import EmptyLogError, RunError
from bench.log import salvage_log
from bench.methods import Method, compile_method, parse_method
from bench.service.benches import ServedBench
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict
from bench.service.requests import (
    IDEMPOTENT,
    NOT_MODIFIED,
    IdempotentRoute,
    KnownTags,
    Sender,
    find_first_request,
    get_operator,
    make_tag,
    send_unless_known,
)
from bench.service.routes.planning import find_method
from bench.service.routes.run_search import RunSearch
from bench.service.run_registry import make_run_row
from bench.service.views import Run, RunPage, StartRunRequest, make_run_view

router = APIRouter(prefix="/runs", tags=["runs"], route_class=IdempotentRoute)
_START_TIMEOUT = 5.0
"""Time limit from an accepted command to the id of the run [s]."""
_RECORD_TIMEOUT = 5.0
"""Time for which an answer waits until a started run is recorded [s]; a scan of many logs may take longer."""


@router.post("", status_code=201, dependencies=[IDEMPOTENT])
async def start_run(
    request: StartRunRequest, http: Request, context: Context, response: Response, sender: Sender
) -> Run:
    """Start a run; the agent executes and records it even if the service ends."""
    request = request.model_copy(update={"operator": get_operator(sender, request.operator)})
    bench = context.benches.get(request.bench)
    method = await asyncio.to_thread(_check_method, context, bench, request)
    return await begin_run(context, bench, response, method, request, first_request=find_first_request(http))


async def begin_run(
    context: ServiceContext,
    bench: ServedBench,
    response: Response,
    method: Method,
    request: StartRunRequest,
    *,
    continues: str = "",
    first_request: datetime | None = None,
) -> Run:
    """Start a run, and return its view with its address in the header.

    Args:
        context: objects of the service.
        bench: bench of the run.
        response: receives the address.
        method: what to run.
        request: specimen, operator and checkpoint.
        continues: id of the run that it continues; empty without one.
        first_request: UTC of the first request with the idempotency key; a run that it has started is returned.

    Raises:
        RunError: the agent refuses it.
        AgentUnreachableError: the agent does not answer.
        ProblemError: the first request has started a run that is not in the catalogue yet.
    """
    log = _choose_log(context, bench, method, first_request)
    present = await asyncio.to_thread(_find_started, context, bench, log) if first_request else None
    if present is None:
        run, status = await asyncio.to_thread(_request_start, context, bench, method, request, continues, log)
        await _record(context, bench, status)
        present = await asyncio.to_thread(_make_started_view, context, bench, run, status)
    response.headers["Location"] = f"/api/v1/runs/{present.id}"
    return present


async def _record(context: ServiceContext, bench: ServedBench, status: AgentStatus) -> None:
    """Record a started run. The next status records it as well, so that the answer need not wait for ever."""
    with suppress(TimeoutError):
        async with asyncio.timeout(_RECORD_TIMEOUT):
            # Not cancelled, because a thread that writes cannot be.
            await asyncio.shield(context.registry.observe(status, bench.name))


def _choose_log(
    context: ServiceContext, bench: ServedBench, method: Method, first_request: datetime | None
) -> Path | None:
    """Return the file of a new log, equal for each repetition of a request; None if the agent chooses it."""
    if not bench.has_local_logs:
        return None
    utc = first_request or datetime.now(UTC)
    # Several benches may begin the same method in the same millisecond.
    name = f"{bench.name}-{method.name}" if context.benches.are_several else method.name
    return context.data / f"{utc:%Y%m%dT%H%M%S}.{utc.microsecond // 1000:03d}Z-{name}.mcap"


def _find_started(context: ServiceContext, bench: ServedBench, log: Path | None) -> Run | None:
    """Return the run that an earlier request with the same key has started; None if there is none."""
    if log is None:
        return None
    row = context.catalogue.find_run_by_log(log)
    if row is not None:
        return context.make_run_views(row)[0]
    status = bench.monitor.send_command(StatusCommand())
    known = (run for run in (status.run, *status.finished) if run is not None and Path(run.log) == log)
    for run in known:
        return make_run_view(make_run_row(run, context.catalogue, bench.name), [], status)
    if log.exists():
        detail = f"the first request with this key has started a run, {log.name}; it is listed within 15 s"
        raise make_conflict("run-not-listed-yet", "The run is not listed yet", detail)
    return None


def _make_started_view(context: ServiceContext, bench: ServedBench, run: RunStatus, status: AgentStatus) -> Run:
    """Return the view of a run that the agent has begun; as the agent describes it if the catalogue fails.

    An error here would be a lie: the rig moves already, and a second request would only be refused.
    """
    try:
        return _make_view(context, run.id)
    except (ProblemError, CatalogueUnavailableError):
        return make_run_view(make_run_row(run, context.catalogue, bench.name), [], status)


def _make_view(context: ServiceContext, run_id: str) -> Run:
    return context.make_run_views(context.get_run(run_id))[0]


def _check_method(context: ServiceContext, bench: ServedBench, request: StartRunRequest) -> Method:
    """Return a method, by name or from its document, after it was compiled within its limits.

    Raises:
        MethodError: the document is invalid, or the method exceeds its limits.
        ProblemError: there is no method with this name and version, or nothing names a specimen.
    """
    if request.specimen is None and not bench.monitor.describe_bench().specimen:
        detail = "specimen: give the serial number of the damper under test; bench.toml names none"
        raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)
    if isinstance(request.method, str):
        return find_method(context, request.method, request.method_version).method
    parsed = parse_method(request.method, "the request")
    compile_method(parsed)
    return parsed


def _get_day() -> date:
    return datetime.now(UTC).date()


def _request_start(
    context: ServiceContext,
    bench: ServedBench,
    method: Method,
    request: StartRunRequest,
    continues: str,
    log: Path | None,
) -> tuple[RunStatus, AgentStatus]:
    """Send the command, and wait until the agent reports the id of the new run."""
    # Until the new run has an id, the agent reports the previous run.
    before = bench.monitor.get_status().run
    command = RunCommand(
        method=method.model_dump(mode="json", by_alias=True, exclude_defaults=True),
        specimen=request.specimen or "",
        operator=request.operator,
        resume_after=request.resume_after,
        continues=continues,
        certificates=tuple(context.catalogue.certificates.list_current(_get_day(), bench.name).values()),
        checks=context.catalogue.checks.list_latest(bench.name),
        log=None if log is None else str(log),
    )
    status = bench.monitor.send_command(command)
    deadline = time.monotonic() + _START_TIMEOUT
    while status.run is None or (before is not None and status.run.id == before.id):
        if time.monotonic() > deadline:
            raise RunError(f"the rig agent accepted the run but did not start it within {_START_TIMEOUT:g} s")
        status = bench.monitor.send_command(StatusCommand())
    return status.run, status


@router.get("")
def list_runs(
    context: Context,
    search: RunSearch,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
) -> RunPage:
    """List the runs that meet all given conditions, newest first."""
    # One run more than shown, to find out whether there is a next page.
    last = None if before is None else context.get_run(before)
    rows = context.catalogue.list_runs(limit + 1, last, search)
    page = rows[:limit]
    return RunPage(items=tuple(context.make_run_views(*page)), next=page[-1].id if len(rows) > limit else None)


@router.get("/{run_id}", response_model=Run, responses=NOT_MODIFIED)
def get_run(run_id: str, context: Context, known: KnownTags = None) -> Response:
    """Return one run with its progress, its jobs and the result of its newest fit.

    The header `ETag` names this answer, for `If-None-Match`. Its first part names the state of what a person may
    change, for `If-Match` of `PATCH`.
    """
    row = context.get_run(run_id)
    view = context.make_run_views(row)[0]
    return send_unless_known(view, make_tag(view, row.revision), known)


@router.post("/{run_id}/stop")
def stop_run(run_id: str, context: Context) -> AgentStatus:
    """Stop a run in a controlled way: the motion fades out, the coil goes to zero. Harmless if it has ended.

    Refused while another run is in progress on its bench. A run in progress need not be in the catalogue.
    """
    bench = context.get_bench_of_run(run_id)
    is_in_progress(context, bench, run_id)
    # Also after the end of the run, because a stop is harmless then and the latest status may be old.
    return bench.monitor.send_command(StopCommand())


@router.post("/{run_id}/abort")
def abort_run(run_id: str, context: Context) -> AgentStatus:
    """Stop a run at once by the path of a trip, which latches until a reset. Harmless if the run has ended.

    Refused while another run is in progress on its bench; `POST /bench/abort` aborts whatever moves.
    """
    bench = context.get_bench_of_run(run_id)
    command = AbortCommand() if is_in_progress(context, bench, run_id) else StatusCommand()
    return bench.monitor.send_command(command)


def is_in_progress(context: ServiceContext, bench: ServedBench, run_id: str) -> bool:
    """Return whether a run is in progress on its bench; False for one that has ended.

    Raises:
        ProblemError: another run is in progress, or there is no such run.
    """
    run = bench.monitor.send_command(StatusCommand()).run
    if run is None or run.outcome is not None:
        # The catalogue is asked only now, so that nothing delays the end of a run in progress.
        context.get_run(run_id)
        return False
    if run.id != run_id:
        raise make_conflict(
            "another-run", "Another run is in progress", f"run {run.id} is in progress; end that one"
        )
    return True


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
    try:
        salvage_log(path)
    except EmptyLogError as error:
        # A repair that cannot succeed is not offered again; what the agent has reported is kept.
        context.catalogue.end_incomplete(row.id, row.reason if row.ending else str(error))
        raise
    catalogue_log(context.catalogue, path)
