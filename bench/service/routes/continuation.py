"""Routes that pause a run at its next checkpoint and resume it with a new run."""

import asyncio
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Body, Request, Response

from bench.agent_protocol import AgentStatus, PauseCommand
from bench.catalogue import RunRow, read_plan
from bench.errors import LogError
from bench.methods import Method, parse_method
from bench.service.context import Context, ServiceContext
from bench.service.problems import make_conflict
from bench.service.requests import IDEMPOTENT, IdempotentRoute, find_first_request
from bench.service.routes.runs import begin_run, is_in_progress
from bench.service.views import ResumeRunRequest, Run, StartRunRequest

router = APIRouter(prefix="/runs", tags=["runs"], route_class=IdempotentRoute)


@router.post("/{run_id}/pause")
def pause_run(run_id: str, context: Context) -> AgentStatus:
    """End a run at its next checkpoint, with everything at rest; `run.pause` of the answer says where.

    If no checkpoint follows, the pause takes effect after the run, and the answer says so.
    """
    bench = context.get_bench_of_run(run_id)
    if not is_in_progress(context, bench, run_id):
        raise make_conflict("run-ended", "The run has ended", f"run {run_id} cannot be paused; it has ended")
    return bench.monitor.send_command(PauseCommand())


@router.post("/{run_id}/resume", status_code=201, dependencies=[IDEMPOTENT])
async def resume_run(
    run_id: str,
    context: Context,
    http: Request,
    response: Response,
    request: Annotated[ResumeRunRequest | None, Body()] = None,
) -> Run:
    """Start a run that continues a run after its last checkpoint, with the warm-up that the method asks for.

    The new run names the first part in `continues`; both logs are complete recordings of their own.
    """
    row = await asyncio.to_thread(context.get_run, run_id)
    bench = await asyncio.to_thread(context.get_bench_of_run, run_id)
    method, checkpoint = await asyncio.to_thread(_find_continuation, context, row)
    start = StartRunRequest.model_construct(  # the first part was accepted with these values
        method=method.name,
        specimen=row.specimen,
        operator=row.operator,
        resume_after=(request.after if request else "") or checkpoint,
    )
    return await begin_run(
        context, bench, response, method, start, continues=run_id, first_request=find_first_request(http)
    )


def _find_continuation(context: ServiceContext, row: RunRow) -> tuple[Method, str]:
    """Return the method of a run, and the last checkpoint that it passed.

    Raises:
        ProblemError: the run goes on, was completed, or passed no checkpoint.
        LogError: the log cannot be read.
    """
    if row.state == "running" or row.ending == "completed":
        present = "is in progress" if row.state == "running" else "was completed"
        raise make_conflict("nothing-to-resume", "Nothing to resume", f"run {row.id} {present}; start a new run")
    path = context.locate_log(row)
    document, checkpoint = _read_plan(path)
    if not checkpoint:
        raise make_conflict(
            "nothing-to-resume", "Nothing to resume", f"run {row.id} passed no checkpoint; start a new run"
        )
    return parse_method(document, f"the method in {path}"), checkpoint


def _read_plan(path: Path) -> tuple[object, str]:
    plan = read_plan(path)
    if plan.method is None:
        raise LogError(f"{path}: the log contains no method; start a new run")
    return plan.method, plan.checkpoint
